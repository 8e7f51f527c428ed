"""Run folders with rows whose statistics are worked out by hand in the tests."""

import json

import pytest

from hcpg.report.rows import append_rows


def _episode_rows(step, selector, successes, episodes, adapter="paper"):
    return [
        {
            "step": step,
            "phase": "evaluation",
            "selector": selector,
            "adapter": adapter,
            "environment": start % 4,
            "start": start,
            "success_once": start < successes,
            "success_at_end": False,
            "steps_to_success": 7 if start < successes else -1,
            "return": 1.0,
            "length": 10,
        }
        for start in range(episodes)
    ]


@pytest.fixture
def episode_rows():
    return _episode_rows


@pytest.fixture
def write_run(tmp_path):
    return _writer(tmp_path)


@pytest.fixture(scope="session")
def run_writer():
    """As `write_run`, for runs in a folder that outlives a test."""
    return _writer


def _writer(root):
    """Writes a run evaluated every 100 steps; `success` and `bare` count the successes of each evaluation.

    Without a `selector` there are bare evaluations only.
    """

    def write(
        *,
        preset="p",
        seed=0,
        selector="hcpg",
        success=None,
        bare,
        episodes=10,
        run_id="a",
        task="point/reach",
    ):
        path = root / task / preset / f"s{seed}" / run_id
        path.mkdir(parents=True)
        address = {"id": run_id, "task": task, "preset": preset, "seed": seed}
        (path / "manifest.json").write_text(json.dumps({"run": address}))
        (path / "config.json").write_text('{"budget": {"name": "cpu"}}')
        (path / "status.json").write_text('{"state": "finished"}')
        rows = [{"step": 50, "phase": "train", "selector": selector, "adapter": "paper", "start": 0}]
        for place, bare_count in enumerate(bare):
            if success is not None:
                rows += _episode_rows(100 * (place + 1), selector, success[place], episodes)
            rows += _episode_rows(100 * (place + 1), "bare", bare_count, episodes)
        append_rows(path / "episodes.jsonl", rows)
        speeds = (100.0, 300.0, 400.0)
        append_rows(
            path / "metrics.jsonl",
            [
                {"step": 100 * k, "updates": 25 * k, "wall_s": 60.0 * k + seed, "steps_per_s": speed}
                for k, speed in enumerate(speeds, 1)
            ],
        )
        return path

    return write
