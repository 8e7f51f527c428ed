"""One trial as it was lived on the arm, read back from its log, step by step."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hcpg.report.records import RecordError
from hcpg.report.rows import complete_lines
from hcpg.report.trial_records import STEPS, TRIAL
from hcpg.types import Float

Vector = Float[np.ndarray, " 3"]


class Chosen(NamedTuple):
    """What was proposed and selected at a tick."""

    proposals: Float[np.ndarray, "K A"]
    weights: Float[np.ndarray, " K"]
    scores: Float[np.ndarray, " K"]
    """NaN where nothing was selected."""
    phase: float
    """0 before contact, 1 after it; NaN where nothing was selected."""
    spread: float


class LoggedTick(NamedTuple):
    """One tick."""

    number: int
    """Time in periods; skipped ones have one, too."""
    time_s: float
    """Since the first tick."""
    joint_angles: Float[np.ndarray, " J"]
    position: Vector
    """Of the TCP, m."""
    width_m: float
    sights: Mapping[str, Vector]
    """Where the things were seen, m."""
    state: str
    """Of the loop: `run`, `hold` and so on."""
    cause: str
    chosen: Chosen | None
    """None where nothing fit to be executed was proposed."""
    target: Vector | None
    """Where the TCP was sent, m; None where it was held."""
    executed: Float[np.ndarray, " A"] | None
    touched: tuple[str, ...]
    """Limits that changed the action."""
    lateness_ms: float
    policy_ms: float
    """How long proposing and selecting took; NaN where nobody was asked."""
    state_age_ms: float
    sight_age_ms: float
    """Of the oldest sighting needed; NaN where an object was never seen."""
    success: bool


class LoggedTrial(NamedTuple):
    """A trial and its ticks."""

    folder: Path
    facts: Mapping[str, Any]
    """`trial.json`: task, policy, start, kind of the arm."""
    box_m: tuple[Vector, Vector] | None
    """Corners of the box that no target leaves; None where the log does not say."""
    ticks: tuple[LoggedTick, ...]

    @property
    def title(self) -> str:
        """Which trial, in words; a twin's is called a twin's."""
        facts = self.facts
        again = "" if facts["attempt"] == 1 else ", repeated"
        return (
            f"{facts['task']}, {facts['policy']}, start state {facts['start']}, trial {facts['trial']}"
            f" ({facts['code']}{again}), {facts['kind']}"
        )


def read_trial(folder: Path) -> LoggedTrial:
    """The trial in `folder`, an attempt's own.

    Raises:
        RecordError: it is no such folder, or no step is in its log.
    """
    if not (folder / TRIAL).exists():
        raise RecordError(f"{folder} is no trial; name a folder trial_... in that of its task")
    rows = [json.loads(line) for line in complete_lines(folder / STEPS).splitlines()]
    steps = [row for row in rows if row["kind"] == "step"]
    if not steps:
        raise RecordError(f"no step is in {folder / STEPS}; the trial ended before its first tick")
    limits = next((row["limits"] for row in rows if row["kind"] == "connected"), None)
    box = None if limits is None else (np.array(limits["box_low_m"]), np.array(limits["box_high_m"]))
    first_s = steps[0]["tick"]["due_s"]
    ticks = tuple(_tick(row, first_s) for row in steps)
    return LoggedTrial(folder, json.loads((folder / TRIAL).read_text()), box, ticks)


def _tick(row: Mapping[str, Any], first_s: float) -> LoggedTick:
    tick, snapshot, limited = row["tick"], row["snapshot"], row["limited"]
    done = row["executed"] is not None
    return LoggedTick(
        number=tick["number"],
        time_s=tick["due_s"] - first_s,
        joint_angles=np.array(snapshot["joint_angles"], float),
        position=np.array(snapshot["position"], float),
        width_m=_number(snapshot["gripper_width_m"]),
        sights={name: np.array(seen["position"], float) for name, seen in row["sight"].items()},
        state=row["verdict"]["state"],
        cause=row["verdict"]["cause"],
        chosen=_chosen(row["choice"]),
        target=np.array(limited["position"], float) if done else None,
        executed=np.array(row["executed"], float) if done else None,
        touched=tuple(limited["touched"]) if limited else (),
        lateness_ms=1000 * max(tick["woke_s"] - tick["due_s"], 0.0),
        policy_ms=1000 * _number(row["policy_s"]),
        state_age_ms=1000 * (tick["woke_s"] - _number(snapshot["host_time_s"])),
        sight_age_ms=1000 * _number(row["sight_age_s"]),
        success=row["success"],
    )


def _chosen(choice: Mapping[str, Any] | None) -> Chosen | None:
    """Numbers that were not finite are null in a log."""
    if choice is None or choice["unfit"]:
        return None
    proposals, weights, scores = (
        np.array(choice[name], float) for name in ("proposals", "weights", "scores")
    )
    return Chosen(proposals, weights, scores, _number(choice["phase"]), _number(choice["spread"]))


def _number(value: float | None) -> float:
    return float("nan") if value is None else float(value)
