"""The way to a start position: up first, so that nothing is dragged along; then across; then down."""

import numpy as np

from hcpg.types import Float, Tensor

ARRIVED_M = 0.004
_CORNER_M = 0.010
Vector = Float[np.ndarray, " 3"]


class Way:
    """Leads an arm along three straight pieces, each target a bounded step ahead of the measured position.

    The step is the same to the end: friction in the joints holds an arm against small ones.
    """

    def __init__(self, start: Float[Tensor, " 3"], goal: Float[Tensor, " 3"], step_m: float) -> None:
        """`step_m` is the furthest that a target is ahead."""
        begin, end = np.asarray(start, np.float64), np.asarray(goal, np.float64)
        height = max(float(begin[2]), float(end[2]))
        self._points = [np.array([*begin[:2], height]), np.array([*end[:2], height]), end]
        self._step_m = step_m

    def target(self, measured: Float[Tensor, " 3"]) -> Vector | None:
        """Where the arm shall go from where it is measured; None once it has arrived."""
        while self._points and self._reached(self._points[0], np.asarray(measured)):
            self._points.pop(0)
        if not self._points:
            return None
        lead = self._points[0] - measured
        length = float(np.linalg.norm(lead))
        return measured + lead * (self._step_m / length) if length > 0 else self._points[0]

    def _reached(self, point: Vector, measured: Vector) -> bool:
        near_m = ARRIVED_M if len(self._points) == 1 else _CORNER_M
        return float(np.linalg.norm(point - measured)) < near_m
