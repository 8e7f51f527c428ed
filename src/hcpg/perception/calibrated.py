"""Objects that do not move: their positions were measured once, by touching them with the TCP."""

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from hcpg.robot_types import RobotError, Sight, Sighting, Snapshot
from hcpg.types import Tensor


class Calibrated:
    """Positions that never age, in the base frame, m."""

    def __init__(self, positions: Mapping[str, Tensor]) -> None:
        """The positions by object.

        Raises:
            RobotError: one is not three finite numbers.
        """
        self.age_limit_s = float("inf")
        for name, position in positions.items():
            if np.shape(position) != (3,) or not np.isfinite(position).all():
                raise RobotError(
                    f"the position of {name!r} is {position}; give three finite numbers, in metres"
                )
        self._sight = {
            name: Sighting(np.asarray(each, np.float64), float("inf")) for name, each in positions.items()
        }

    @classmethod
    def read(cls, path: Path, objects: tuple[str, ...]) -> "Calibrated":
        """The positions of `objects` from a JSON file: `{"hole": [0.45, 0.1, 0.02]}`.

        Raises:
            RobotError: the file lacks an object, or holds no three numbers for it.
        """
        stored = json.loads(path.read_text())
        missing = [name for name in objects if name not in stored]
        if missing:
            has = ", ".join(stored) or "nothing"
            raise RobotError(
                f"{path} lacks the position of {', '.join(missing)}; it has {has}. Touch it off first."
            )
        return cls({name: np.asarray(stored[name], np.float64) for name in objects})

    def look(self, snapshot: Snapshot, now_s: float) -> Sight:
        """The positions; the same at every call."""
        return self._sight

    def forget(self) -> None:
        """Nothing: these do not move."""
