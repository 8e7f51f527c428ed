"""The overview of HCPG-Flow as an SVG: acting with the selector's three steps above, learning below.

The proposals' scores and weights in it are computed by the selector itself, for one small scene.

Source: paper, the figure of the framework's overview.
"""

from typing import NamedTuple

import numpy as np

from hcpg.report.svg import INK, MUTED, Number, Point, arrow, bar, box, document, dot, text
from hcpg.selection import Diagnostics, Selector, select
from hcpg.types import Float, Scene

WIDTH, HEIGHT = 1432, 640
TITLE = "HCPG-Flow: a flow actor proposes, contact progress selects, the learner stays as it was"
PLAIN, ACCENT, PALE = "#F4F5F7", "#0072B2", "#E8F2FA"
OBJECT, GOAL = "#E69F00", "#009E73"
SHADES = ("#111111", "#555555", "#8C8C8C", "#BDBDBD")
"""From the proposal with the largest weight to that with the smallest."""
PROPOSALS = np.array([[0.95, 0.0, 0.1], [0.45, 0.0, -0.85], [-0.35, 0.0, 0.75], [0.75, 0.0, 0.65]])
"""Four translations in the plane x, z, the plane of the drawing."""
TOOL, THING, PLACE = np.array([0.0, 0.0, 0.24]), np.array([0.2, 0.0, 0.06]), np.array([0.36, 0.0, 0.3])
SCALE, REACH = 330.0, 52.0
"""Pixels per metre, and per unit of action."""


class Drawn(NamedTuple):
    """What the selector makes of the scene in one phase."""

    action: Float[np.ndarray, " 3"]
    diagnostics: Diagnostics


def considered(contact: float) -> Drawn:
    """The selection among `PROPOSALS`, before (0) or after (1) contact."""
    scene = Scene.of(_tool(contact), THING, PLACE, np.array(contact))
    return Drawn(*select(PROPOSALS, scene, Selector()))


def _tool(contact: float) -> Float[np.ndarray, " 3"]:
    """Above the object before contact, at it after."""
    return THING if contact else TOOL


def framework_svg() -> str:
    """The whole diagram; the same text every time."""
    shapes = [*_lanes(), *_task(), *_actor(), *_selector(), *_action(), *_learning(), *_ways()]
    return document(WIDTH, HEIGHT, TITLE, shapes)


def _lanes() -> list[str]:
    return [
        text((24, 448), "ACTING, at every control step", 13, MUTED, "start", "bold"),
        text((24, 480), "LEARNING, unchanged", 13, MUTED, "start", "bold"),
        f'<path d="M24 458H{WIDTH - 24}" stroke="{MUTED}" stroke-width="1" stroke-dasharray="2 5"/>',
    ]


def _headed(corner: Point, size: Point, heading: str, below: str, fill: str = PLAIN) -> list[str]:
    middle = corner[0] + size[0] / 2
    return [
        box(corner, size, fill),
        text((middle, corner[1] + 28), heading, 17, style="bold"),
        text((middle, corner[1] + 48), below, 13, MUTED),
    ]


def _task() -> list[str]:
    """A gripper over an object, and its goal."""
    lines = ["tool, object, goal: m", "contact flag, or none", "simulator or arm"]
    shapes = _headed((24, 70), (210, 350), "task", "seen in the observation")
    tool, thing, place = (130.0, 178.0), (86.0, 262.0), (180.0, 228.0)
    shapes += [
        f'<path d="M{tool[0] - 14} {tool[1] + 22}v-18h28v18M{tool[0]} {tool[1] + 4}v-32" fill="none" '
        f'stroke="{INK}" stroke-width="5"/>',
        bar((thing[0] - 13, thing[1] - 13), (26, 26), OBJECT),
        f'<circle cx="{place[0]}" cy="{place[1]}" r="13" fill="none" stroke="{GOAL}" stroke-width="3"/>',
        dot(place, 4, GOAL),
        text((thing[0], thing[1] + 32), "object", 13),
        text((place[0], place[1] + 32), "goal", 13),
        text((tool[0] + 24, tool[1] - 8), "tool", 13, anchor="start"),
    ]
    return shapes + [text((129, 345 + 22 * row), line, 13, MUTED) for row, line in enumerate(lines)]


def _actor() -> list[str]:
    """Noise goes in, proposals come out."""
    shapes = _headed((292, 70), (220, 350), "flow actor", "K = 4 proposals in one call")
    for row in range(4):
        height = 158 + 44 * row
        shapes += [
            dot((326, height), 9, "none", INK),
            text((326, height + 4.5), "ε", 12, style="italic"),
            arrow([(342, height), (412, height)], MUTED, 1.4),
            text((436, height + 5), f"a{'¹²³⁴'[row]}", 17, style="italic"),
        ]
    shapes += [
        text((402, 345), "noise to action in M flow steps", 13, MUTED),
        text((402, 367), "all of the action: translation,", 13, MUTED),
        text((402, 389), "rotation, gripper", 13, MUTED),
    ]
    return shapes


def _selector() -> list[str]:
    """The three steps, and what is not in them."""
    shapes = [
        box((570, 56), (640, 378), PALE, ACCENT, 2.5),
        text((890, 86), "HCPG selector", 19, ACCENT, style="bold"),
        text((890, 106), "analytic: nothing in it is learned, no critic ranks", 13, MUTED),
    ]
    before, after = considered(0.0), considered(1.0)
    headings = ("1  where to, now?", "2  score each proposal", "3  blend")
    lines = ("contact switches the target", "progress along the target", "softmax of standardised scores")
    for column, (heading, line) in enumerate(zip(headings, lines, strict=True)):
        middle = 680 + 210 * column
        shapes += [text((middle, 138), heading, 15, style="bold"), text((middle, 156), line, 12.5, MUTED)]
    rows = ((172, "before contact", 0.0, before), (302, "after contact", 1.0, after))
    for top, phase, contact, drawn in rows:
        shapes += _phase(top, phase, contact, drawn)
    return shapes


def _phase(top: Number, name: str, contact: float, drawn: Drawn) -> list[str]:
    """One row: the target, the scores, the blend."""
    origin = (604.0, top + 108)
    tool, thing, place = (_at(origin, point) for point in (_tool(contact), THING, PLACE))
    target = [thing, place] if contact else [tool, thing]
    color = GOAL if contact else OBJECT
    order = np.argsort(np.argsort(-drawn.diagnostics.weights))
    shapes = [
        text((586, top + 14), name, 12.5, INK, "start", "bold"),
        bar((thing[0] - 7, thing[1] - 7), (14, 14), OBJECT),
        dot(tool, 5, INK),
        dot(place, 7, GOAL),
        arrow(target, color, 3),
    ]
    return [*shapes, *_scores(top, drawn, order, contact), *_blend(top, drawn, order)]


def _at(origin: Point, point: Float[np.ndarray, " 3"]) -> Point:
    return origin[0] + SCALE * float(point[0]), origin[1] - SCALE * float(point[2])


def _scores(top: Number, drawn: Drawn, order: np.ndarray, contact: float) -> list[str]:
    """The proposals as arrows from the tool, and a bar for the score of each."""
    tool, goal = (830.0, top + 66), PLACE - THING if contact else THING - TOOL
    direction = goal / np.linalg.norm(goal)
    far = (tool[0] + 78 * direction[0], tool[1] - 78 * direction[2])
    shapes = [arrow([tool, far], GOAL if contact else OBJECT, 7), dot(tool, 5, INK)]
    for move, place in zip(PROPOSALS, order, strict=True):
        tip = (tool[0] + REACH * move[0], tool[1] - REACH * move[2])
        shapes.append(arrow([tool, tip], SHADES[place], 2.2))
    for row, (score, place) in enumerate(zip(drawn.diagnostics.scores, order, strict=True)):
        left, height, length = 938.0, top + 24 + 22 * row, 34 * float(score)
        shapes += [
            bar((min(left, left + length), height), (abs(length), 13), SHADES[place]),
            text((left + 72, height + 11), f"{float(score):+.2f}", 12, anchor="end"),
        ]
    return [*shapes, f'<path d="M938 {top + 18:g}v94" stroke="{INK}" stroke-width="1"/>']


def _blend(top: Number, drawn: Drawn, order: np.ndarray) -> list[str]:
    """A bar for the weight of each proposal, and the action that they make."""
    shapes = []
    for row, (weight, place) in enumerate(zip(drawn.diagnostics.weights, order, strict=True)):
        height = top + 24 + 22 * row
        shapes += [
            bar((1030, height), (62 * float(weight), 13), SHADES[place]),
            text((1128, height + 11), f"{float(weight):.2f}", 12, anchor="end"),
        ]
    tool = (1144.0, top + 66)
    tip = (tool[0] + REACH * float(drawn.action[0]), tool[1] - REACH * float(drawn.action[2]))
    return [*shapes, dot(tool, 5, INK), arrow([tool, tip], ACCENT, 4)]


def _action() -> list[str]:
    shapes = _headed((1262, 166), (146, 150), "execute", "one action")
    lines = ["a* = clip(Σ ωᵢ aⁱ)", "within [-1, 1]"]
    return shapes + [text((1335, 250 + 24 * row), line, 14.5) for row, line in enumerate(lines)]


def _learning() -> list[str]:
    shapes = _headed((1160, 520), (248, 90), "replay", "")
    shapes += [text((1284, 576), "(s, a*, r, s′): what was executed", 13.5, MUTED)]
    shapes += _headed((620, 520), (380, 90), "SAC-Flow update", "")
    shapes += [text((810, 576), "critics and flow actor, the original objectives", 13.5, MUTED)]
    return shapes


def _ways() -> list[str]:
    """What flows from box to box."""
    return [
        arrow([(234, 200), (290, 200)]),
        text((262, 190), "s", 15, style="italic"),
        arrow([(129, 70), (129, 44), (640, 44), (640, 54)], ACCENT),
        text((400, 38), "scene", 13.5, ACCENT),
        arrow([(512, 245), (568, 245)]),
        arrow([(1210, 241), (1260, 241)], ACCENT, 3),
        text((1235, 231), "a*", 15, ACCENT, style="italic"),
        arrow([(1335, 166), (1335, 20), (60, 20), (60, 68)]),
        text((890, 38), "next observation", 13.5),
        arrow([(1335, 316), (1335, 518)]),
        arrow([(1160, 565), (1002, 565)]),
        text((1081, 555), "batches", 13),
        arrow([(620, 565), (402, 565), (402, 422)]),
        text((470, 555), "θ", 15, style="italic"),
        text((810, 636), "the learner never sees the selector", 13, MUTED, style="italic"),
    ]
