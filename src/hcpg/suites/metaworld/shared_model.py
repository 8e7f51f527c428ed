"""One model in memory for all environments of a task in a process.

A compiled model of Meta-World takes 20 MB and a quarter of a second. Of its arrays the package writes two,
when an episode begins: the places of bodies and of sites. All others are every environment's.
"""

from importlib import import_module
from typing import Any
from weakref import WeakValueDictionary

import numpy as np

PLACES = ("body_pos", "site_pos")
"""What the package moves, m; a test holds every task to it."""


class SharedModel:
    """A compiled model and where things lie in it. Step a simulation of it with its own places put first."""

    def __init__(self, model: Any) -> None:
        self.model = model
        self._places = [getattr(model, name) for name in PLACES]
        self._of_file = self.places()

    def new_data(self) -> Any:
        """Data for another simulation, with everything where the model's file has it."""
        mujoco: Any = import_module("mujoco")
        self.put(self._of_file)
        return mujoco.MjData(self.model)

    def places(self) -> list[np.ndarray]:
        """A copy of where everything is now."""
        return [place.copy() for place in self._places]

    def put(self, places: list[np.ndarray]) -> None:
        """Move everything to where it was when the copy was made."""
        for place, kept in zip(self._places, places, strict=True):
            place[:] = kept


_in_use: WeakValueDictionary[str, SharedModel] = WeakValueDictionary()
"""By file; the last environment that uses a model takes it along."""


def simulated(stock: Any, simulation: Any) -> tuple[SharedModel, Any]:
    """The model of a simulation of the package's class `stock`, and data of its own."""
    path = simulation.fullpath
    if path in _in_use:
        return _in_use[path], _in_use[path].new_data()
    model, data = stock._initialize_simulation(simulation)
    shared = _in_use[path] = SharedModel(model)
    return shared, data
