"""What a drill found, as lines and as the table of docs/robot_safety.md."""

import math
from collections.abc import Mapping, Sequence

from hcpg.loops.control.drill import DrillError, Outcome

FURTHEST_OUTSIDE_MM = 20.0
"""An impedance lets the arm overshoot a target on the box's wall; a target is never outside."""
COLUMNS = (
    "fault",
    "injected",
    "held after, ms",
    "first episode",
    "why",
    "next episode",
    "cost, s",
    "outside the box, mm",
    "moved in a hold, mm",
    "ticks at the box",
    "commands while wrong",
    "steps logged",
)


def harmless(outcome: Outcome) -> bool:
    """Whether the arm kept to its box, no command reached it in a fault, and no step is missing."""
    inside = outcome.furthest_outside_mm <= FURTHEST_OUTSIDE_MM
    return inside and outcome.applied_while_wrong == 0 and outcome.logged == outcome.ticks


def line(name: str, outcome: Outcome) -> str:
    """One outcome for the terminal."""
    mark = "ok" if harmless(outcome) else "HARM"
    ended = f"; session: {outcome.session_ended}" if outcome.session_ended else ""
    return f"{mark:4}  {name:26}  {', '.join(outcome.endings)} ({outcome.cause}){ended}"


def place(robot: str, address: str | None, serve: bool = False) -> str:
    """The options that name a robot, whichever address it has: the name of its place in a document."""
    where = "" if address is None else " --address ADDRESS"
    return f"--robot {robot}{where}{' --serve' * serve}"


def table(place: str, task: str, outcomes: Mapping[str, Outcome]) -> str:
    """All outcomes in Markdown, with the command that makes them."""
    head = [_line(COLUMNS), _line(["---"] * len(COLUMNS))]
    rows = [_line(_cells(name, outcome)) for name, outcome in outcomes.items()]
    count = sum(map(harmless, outcomes.values()))
    total = f"\n{count} of {len(outcomes)} harmless: `hcpg robot drill {task} {place}`.\n"
    return "".join([*head, *rows, total])


def inserted(document: str, place: str, table: str) -> str:
    """The document with `table` in the place that two comments mark.

    Raises:
        DrillError: the document has no such place.
    """
    begin, end = f"<!-- drill {place} -->\n", "<!-- end -->\n"
    before, found, rest = document.partition(begin)
    _, ended, after = rest.partition(end)
    if not found or not ended:
        raise DrillError(f"the document has no place for the table; give it the lines {begin!r} and {end!r}")
    return f"{before}{begin}\n{table}\n{end}{after}"


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |\n"


def _cells(name: str, outcome: Outcome) -> Sequence[str]:
    later = [*outcome.endings, f"none: {outcome.session_ended}"]
    return (
        f"`{name}`",
        outcome.what,
        _number(outcome.hold_after_ms, 0),
        outcome.endings[0],
        outcome.cause,
        later[1],
        _number(outcome.cost_s, 1),
        _number(outcome.furthest_outside_mm, 1),
        _number(outcome.moved_while_held_mm, 1),
        str(outcome.limited.get("box", 0)),
        str(outcome.applied_while_wrong),
        f"{outcome.logged} of {outcome.ticks}",
    )


def _number(value: float, digits: int) -> str:
    return "-" if math.isnan(value) else f"{value:.{digits}f}"
