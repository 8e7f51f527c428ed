"""What is seen of a twin's scene: some positions touched off once, others photographed late, with noise."""

from typing import Protocol, runtime_checkable

import numpy as np

from hcpg.perception.truth import NoisyTruth, Poorness
from hcpg.robot_types import Sight, Sighting, Snapshot
from hcpg.twin.bench import Places
from hcpg.twin.scenes import Scene


@runtime_checkable
class Source(Protocol):
    """A scene that tells where its things are: a `World`, or a `Listener` to a served one."""

    def surveyed(self) -> Places:
        """What was touched off, by name."""
        ...

    def moving(self) -> Places:
        """What a camera follows, by name."""
        ...


class TwinEyes:
    """The perception of a twin."""

    def __init__(self, source: Source, scene: Scene, seed: int) -> None:
        """`seed` draws the noise of the pictures; how poor they are is the scene's."""
        self._source = source
        self._camera = NoisyTruth(source.moving, Poorness(**scene.camera._asdict()), seed)
        self.age_limit_s = scene.camera.age_limit_s

    def look(self, snapshot: Snapshot, now_s: float) -> Sight:
        """The touched-off positions, which do not age, and what was photographed last."""
        fixed = {name: Sighting(np.asarray(place), np.inf) for name, place in self._source.surveyed().items()}
        return {**fixed, **self._camera.look(snapshot, now_s)}

    def forget(self) -> None:
        """Drop what was photographed."""
        self._camera.forget()
