"""What the twin's arm may do, task by task; the control loop shows and applies it."""

from hcpg.robot_types import Limits

BOX_LOW_M, BOX_HIGH_M = (0.28, -0.22, 0.022), (0.66, 0.22, 0.40)
"""Of the TCP: the fingers end 8 mm below it, so they stay 14 mm above the table."""
LOWEST_M = {"peg-insertion": 0.088, "button-press": 0.040, "drawer-closing": 0.040}
"""Lower side of the box where a task needs less room: no lower than its goal."""


def limits(task: str) -> Limits:
    """The limits for a task's part of the name after the slash."""
    low = (*BOX_LOW_M[:2], LOWEST_M.get(task, BOX_LOW_M[2]))
    return Limits(box_low_m=low, box_high_m=BOX_HIGH_M)
