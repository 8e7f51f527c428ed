"""What a training shows of itself: a live picture on a terminal, plain lines elsewhere."""

import time
from collections.abc import Mapping
from typing import Any

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from hcpg.loops.child import Message
from hcpg.loops.population import Lane, View
from hcpg.report.records import BARE
from hcpg.report.statistics import wilson

PROGRESS_LINES = 10
"""Plain lines about the progress of a whole run."""
BAR_CELLS = 22
_COLOURS = {"finished": "green", "stopped": "yellow", "diverged": "red", "failed": "red"}


class Progress:
    """What is known about one run."""

    def __init__(self, lane: Lane, learns_after: int) -> None:
        """`learns_after` is the warm-up, whose steps say nothing about the time that learning takes."""
        self.lane, self._learns_after = lane, learns_after
        self.row: dict[str, Any] = {}
        """The newest row of metrics."""
        self.evaluation: dict[str, Any] = {}
        """The newest evaluation: `step`, and `successes` as [count, episodes] by selector."""
        self.end: Message | None = None
        self._anchor: tuple[int, float] | None = None
        self._told_s = 0.0

    @property
    def name(self) -> str:
        """Preset and seed."""
        return f"{self.lane.preset} s{self.lane.seed}"

    @property
    def step(self) -> int:
        """Environment steps so far."""
        return int(self.row.get("step", 0))

    def note(self, message: Message) -> None:
        """Take in a piece of news."""
        if message.kind == "progress":
            self.row, self._told_s = message.facts, time.monotonic()
            if self._anchor is None and self.step >= self._learns_after:
                self._anchor = (self.step, float(self.row["wall_s"]))
        elif message.kind == "evaluation":
            self.evaluation = message.facts
        elif message.kind in _COLOURS:
            self.end = message

    def time_left_s(self) -> float | None:
        """At the rate since learning began, evaluations included; None while that is unknown."""
        if self._anchor is None or self.step <= self._anchor[0]:
            return None
        rate = (float(self.row["wall_s"]) - self._anchor[1]) / (self.step - self._anchor[0])
        since_told_s = time.monotonic() - self._told_s
        return max(0.0, (self.lane.steps - self.step) * rate - since_told_s)


class LiveView:
    """Every run's bar and numbers, redrawn in place."""

    def __init__(self, console: Console, progress: Mapping[Lane, Progress], heading: str) -> None:
        self._progress, self._heading, self._words = progress, heading, ""
        self._live = Live(console=console, auto_refresh=False, transient=False)

    def __enter__(self) -> View:
        self._live.start()
        self.beat()
        return self

    def __exit__(self, *_: object) -> None:
        self.beat()
        self._live.stop()

    def tell(self, lane: Lane, message: Message) -> None:
        """News of one run."""
        self._progress[lane].note(message)

    def say(self, text: str) -> None:
        """A word about the whole command, below the runs."""
        self._words = text

    def beat(self) -> None:
        """Draw."""
        self._live.update(self._picture(), refresh=True)

    def _picture(self) -> RenderableType:
        parts: list[RenderableType] = [Text(self._heading, style="bold")]
        width = max(len(progress.name) for progress in self._progress.values())
        for progress in self._progress.values():
            parts += [Text(), _bar(progress, width), *_numbers(progress)]
        if self._words:
            parts += [Text(), Text(self._words, style="yellow")]
        return Group(*parts)


class PlainView:
    """One line per evaluation, per tenth of a run, and per end of a run."""

    def __init__(self, console: Console, progress: Mapping[Lane, Progress], heading: str) -> None:
        self._console, self._progress, self._heading = console, progress, heading
        self._shown = dict.fromkeys(progress, 0)

    def __enter__(self) -> View:
        self.say(self._heading)
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def tell(self, lane: Lane, message: Message) -> None:
        """News of one run."""
        progress = self._progress[lane]
        progress.note(message)
        if message.kind == "opened":
            self.say(f"{progress.name}: {message.facts['folder']}")
        elif message.kind == "evaluation":
            self.say(f"{progress.name}: {evaluation_text(progress.evaluation)}")
        elif message.kind == "progress":
            self._say_progress(progress)
        elif progress.end is message:
            self.say(f"{progress.name}: {end_text(message)}")

    def _say_progress(self, progress: Progress) -> None:
        passed = progress.step * PROGRESS_LINES // progress.lane.steps
        if passed > self._shown[progress.lane]:
            self._shown[progress.lane] = passed
            self.say(f"{progress.name}: {_progress_text(progress)}")

    def say(self, text: str) -> None:
        """A line of its own, written at once."""
        self._console.print(text, soft_wrap=True, markup=False, highlight=False)
        self._console.file.flush()

    def beat(self) -> None:
        """Nothing changes with time alone."""


def view(console: Console, progress: Mapping[Lane, Progress], heading: str) -> LiveView | PlainView:
    """The view that fits where the output goes."""
    return (LiveView if console.is_terminal else PlainView)(console, progress, heading)


def evaluation_text(evaluation: Mapping[str, Any]) -> str:
    """Success rates by selector, each with its 95 % Wilson interval in percent."""
    parts = [rate_text(name, *counts) for name, counts in evaluation["successes"].items()]
    return f"evaluation at step {evaluation['step']:,}: {', '.join(parts)}"


def rate_text(name: str, successes: int, episodes: int) -> str:
    """A success rate with its 95 % Wilson interval, both in percent, and the counts."""
    low, high = wilson(successes, episodes)
    label = "bare actor" if name == BARE else name
    percent = 100 * successes / episodes
    return f"{label} {percent:.0f} % [{100 * low:.0f}, {100 * high:.0f}] ({successes}/{episodes})"


def end_text(end: Message) -> str:
    """How a run ended, in words."""
    facts = end.facts
    if end.kind == "failed":
        return f"failed: {facts['error']}"
    at = f"{end.kind} at step {facts['step']:,}"
    return f"{at}: {facts['quantity']} is not finite" if end.kind == "diverged" else at


def _bar(progress: Progress, name_width: int) -> RenderableType:
    share = progress.step / progress.lane.steps
    line = Table.grid(padding=(0, 1))
    line.add_row(
        Text(progress.name.ljust(name_width), style="cyan"),
        ProgressBar(total=1.0, completed=share, width=BAR_CELLS),
        Text(f"{100 * share:3.0f} %"),
        Text(_clock_text(progress, "  ")),
    )
    return line


def _clock_text(progress: Progress, separator: str) -> str:
    if progress.end is not None or not progress.row:
        return ""
    left_s = progress.time_left_s()
    parts = [] if left_s is None else [f"{_duration(left_s)} left"]
    return separator.join([*parts, f"{progress.row['steps_per_s']:,.0f} steps/s"])


def _numbers(progress: Progress) -> list[RenderableType]:
    facts = {
        "training": _training_text(progress.row),
        "evaluation": evaluation_text(progress.evaluation)[len("evaluation ") :]
        if progress.evaluation
        else "",
        "selector": _selector_text(progress.row),
    }
    table = Table.grid(padding=(0, 1))
    for label, text in facts.items():
        if text:
            table.add_row(Text(f"  {label}", style="dim"), Text(text))
    if progress.end is not None:
        table.add_row(Text("  ended", style="dim"), Text(end_text(progress.end), _COLOURS[progress.end.kind]))
    elif not progress.row:
        table.add_row(Text("  starting: simulators and compiler", style="dim"))
    return [table] if table.rows else []


def _training_text(row: Mapping[str, Any]) -> str:
    return (
        f"{100 * row['train_success']:.0f} % succeeded (last 20 episodes at most)"
        if "train_success" in row
        else ""
    )


def _selector_text(row: Mapping[str, Any]) -> str:
    """What the selector did since the last row; nothing while actions bypass it."""
    if "selector_phase" not in row:
        return ""
    return (
        f"{100 * row['selector_phase']:.0f} % in contact, "
        f"{row['selector_effective_candidates']:.1f} effective candidates, "
        f"spread {row['selector_spread']:.2f}, blend gap {row['selector_blend_gap']:.2f}"
    )


def _progress_text(progress: Progress) -> str:
    parts = [f"step {progress.step:,} of {progress.lane.steps:,}", _clock_text(progress, ", ")]
    parts += [_training_text(progress.row), _selector_text(progress.row)]
    return ", ".join(part for part in parts if part)


def _duration(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"
