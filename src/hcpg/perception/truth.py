"""A twin's own knowledge of where things are, made as poor as a camera's: sampled, late, noisy, with gaps."""

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from hcpg.robot_types import Sight, Sighting, Snapshot
from hcpg.types import Float


@dataclass(frozen=True)
class Poorness:
    """How much worse than the truth; the defaults are those of a 40 mm AprilTag with refined corners."""

    rate_hz: float = 10.0
    delay_s: float = 0.1
    """From the picture to the answer."""
    noise_m: tuple[float, float, float] = (0.0001, 0.0001, 0.001)
    """Standard deviation along x, y, z."""
    dropouts: float = 0.02
    """Share of the pictures in which an object is not found."""
    age_limit_s: float = 0.4
    """A sighting older than this is not to be acted on: a picture, its delay and two dropouts."""


class NoisyTruth:
    """Sightings drawn from a truth; the same seed gives the same noise."""

    def __init__(
        self, read: Callable[[], Mapping[str, Float[np.ndarray, " 3"]]], poorness: Poorness, seed: int
    ) -> None:
        """`read` gives the true positions of now, m."""
        self._read, self._poorness, self._seed = read, poorness, seed
        self.age_limit_s = poorness.age_limit_s
        self._picture = -1
        self._developing: deque[dict[str, Sighting]] = deque()
        self._sight: dict[str, Sighting] = {}

    def look(self, snapshot: Snapshot, now_s: float) -> Sight:
        """What has been found in the pictures that are old enough to be answered."""
        picture = int(np.floor(now_s * self._poorness.rate_hz + 1e-6))
        if picture != self._picture:
            self._picture = picture
            self._developing.append(self._found(now_s))
        while self._developing and self._is_ready(self._developing[0], now_s):
            self._sight = {**self._sight, **self._developing.popleft()}
        return self._sight

    def forget(self) -> None:
        """Drop all sightings, also those of pictures not answered yet."""
        self._developing.clear()
        self._sight = {}

    def _is_ready(self, found: dict[str, Sighting], now_s: float) -> bool:
        return all(each.seen_s + self._poorness.delay_s <= now_s + 1e-6 for each in found.values())

    def _found(self, now_s: float) -> dict[str, Sighting]:
        found = {}
        for index, (name, position) in enumerate(self._read().items()):
            random = np.random.default_rng([self._seed, self._picture, index])
            if random.uniform() >= self._poorness.dropouts:
                seen = np.asarray(position, np.float64) + random.normal(size=3) * self._poorness.noise_m
                found[name] = Sighting(seen, now_s)
        return found
