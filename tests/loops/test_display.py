"""Only what is known is shown: rates with their intervals, time left once learning has a rate."""

import io

import pytest
from rich.console import Console

from hcpg.loops import display
from hcpg.loops.child import Message
from hcpg.loops.display import LiveView, PlainView, Progress, view
from hcpg.loops.population import Lane

LANE = Lane("point/reach", "hcpg_flow", 0, 1000)
SELECTOR = {
    "selector_phase": 0.25,
    "selector_effective_candidates": 2.06,
    "selector_spread": 0.5,
    "selector_blend_gap": 0.126,
}
EVALUATION = Message("evaluation", 0, {"step": 300, "successes": {"hcpg": [18, 20], "bare": [9, 20]}})


def row(step, wall_s, **facts):
    return Message("progress", 0, {"step": step, "wall_s": wall_s, "steps_per_s": 1234.6, **facts})


@pytest.fixture
def clock(monkeypatch):
    now = [50.0]
    monkeypatch.setattr(display.time, "monotonic", lambda: now[0])
    return now


def test_time_left_counts_from_the_end_of_the_warm_up(clock):
    progress = Progress(LANE, learns_after=100)
    progress.note(row(50, 0.1))
    assert progress.time_left_s() is None
    progress.note(row(100, 2.0))
    assert progress.time_left_s() is None
    progress.note(row(300, 12.0))
    assert progress.time_left_s() == pytest.approx(700 * 10.0 / 200)
    clock[0] += 4.0
    assert progress.time_left_s() == pytest.approx(31.0)


def test_rates_carry_their_wilson_interval():
    # By the formula: (p + z^2/2n -+ z sqrt(p(1-p)/n + z^2/4n^2)) / (1 + z^2/n), z = 1.96, n = 20.
    assert display.evaluation_text(EVALUATION.facts) == (
        "evaluation at step 300: hcpg 90 % [70, 97] (18/20), bare actor 45 % [26, 66] (9/20)"
    )


def test_plain_lines_where_there_is_no_terminal(clock):
    console = Console(file=io.StringIO(), width=40)
    progress = {LANE: Progress(LANE, learns_after=100)}
    shown = view(console, progress, "heading")
    assert isinstance(shown, PlainView)
    with shown:
        shown.tell(LANE, Message("opened", 0, {"folder": "runs/[a]"}))
        for step in (50, 100, 150, 200, 300):
            shown.tell(LANE, row(step, step / 20, train_success=0.35, **SELECTOR))
        shown.tell(LANE, EVALUATION)
        shown.tell(LANE, Message("diverged", 0, {"step": 304, "quantity": "reward"}))
    selector = "25 % in contact, 2.1 effective candidates, spread 0.50, blend gap 0.13"
    training = "35 % succeeded (last 20 episodes at most)"
    assert console.file.getvalue().splitlines() == [
        "heading",
        "hcpg_flow s0: runs/[a]",
        f"hcpg_flow s0: step 100 of 1,000, 1,235 steps/s, {training}, {selector}",
        f"hcpg_flow s0: step 200 of 1,000, 0:40 left, 1,235 steps/s, {training}, {selector}",
        f"hcpg_flow s0: step 300 of 1,000, 0:35 left, 1,235 steps/s, {training}, {selector}",
        "hcpg_flow s0: evaluation at step 300: hcpg 90 % [70, 97] (18/20), bare actor 45 % [26, 66] (9/20)",
        "hcpg_flow s0: diverged at step 304: reward is not finite",
    ]


def picture(progress, words=""):
    console = Console(file=io.StringIO(), width=100, force_terminal=True, color_system=None)
    with LiveView(console, {LANE: progress}, "heading") as shown:
        shown.say(words)
    return console.file.getvalue().split("heading")[-1]


def test_a_run_that_has_told_nothing_shows_no_numbers():
    text = picture(Progress(LANE, learns_after=100))
    assert "starting: simulators and compiler" in text
    assert not {"steps/s", "left", "training", "evaluation", "selector"} & set(text.split())


def test_the_live_view_shows_bar_rates_and_selector(clock):
    progress = Progress(LANE, learns_after=100)
    for message in (row(100, 5.0), row(580, 29.0, train_success=0.65, **SELECTOR), EVALUATION):
        progress.note(message)
    text = picture(progress, "stopping")
    assert "58 % 0:21 left  1,235 steps/s" in text
    assert "training   65 % succeeded (last 20 episodes at most)" in text
    assert "at step 300: hcpg 90 % [70, 97] (18/20), bare actor 45 % [26, 66] (9/20)" in text
    assert "25 % in contact, 2.1 effective candidates, spread 0.50, blend gap 0.13" in text
    assert "stopping" in text


def test_a_finished_run_shows_no_time_left(clock):
    progress = Progress(LANE, learns_after=100)
    for message in (row(100, 5.0), row(1000, 50.0), Message("finished", 0, {"step": 1000})):
        progress.note(message)
    text = picture(progress)
    assert "100 %" in text
    assert "finished at step 1,000" in text
    assert "left" not in text
