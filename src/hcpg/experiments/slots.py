"""What a job can have of a machine: a core, or a share of a card. Launches at once take turns."""

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Mapping
from io import TextIOWrapper
from math import floor
from pathlib import Path
from typing import NamedTuple

from hcpg.experiments.claims import locked
from hcpg.loops import machine

_COUNT_DEVICES = "import jax; print(jax.local_device_count())"


class Slot(NamedTuple):
    """Room for one job."""

    name: str
    cores: frozenset[int]
    """The cores that its processes keep to."""
    variables: Mapping[str, str]
    """Environment variables of its processes."""

    def take(self) -> TextIOWrapper | None:
        """The slot's lock, held; None if a job of this user's has the slot."""
        return locked(own_folder() / self.name.replace(" ", "-"))


def own_folder() -> Path:
    """Where a user's jobs on this machine leave what does not outlive them, such as their locks."""
    return Path(tempfile.gettempdir()) / f"hcpg-flow-{os.getuid()}"


def core_slots(cores: Iterable[int]) -> list[Slot]:
    """A slot for every core."""
    return [Slot(f"core {core}", frozenset({core}), {"JAX_PLATFORMS": "cpu"}) for core in cores]


def card_slots(cards: list[str], share: float, cores: list[int]) -> list[Slot]:
    """As many slots on every card as its `share` allows, each with its part of the cores."""
    per_card = jobs_per_card(share)
    places = [(card, part) for card in cards for part in range(per_card)]
    return [
        Slot(
            f"card {card}" if per_card == 1 else f"card {card} part {part}",
            frozenset(cores[index :: len(places)] or cores),
            {"CUDA_VISIBLE_DEVICES": card, **machine.gpu_share(os.environ, per_card)},
        )
        for index, (card, part) in enumerate(places)
    ]


def jobs_per_card(share: float) -> int:
    """How many jobs with this share of a card it holds."""
    return floor(1 / share)


def cards() -> list[str]:
    """The cards that JAX would compute on here, by the names that CUDA_VISIBLE_DEVICES gives them."""
    # In a process of its own: one that has asked JAX holds a card's memory.
    asked = subprocess.run(
        [sys.executable, "-c", _COUNT_DEVICES], stdout=subprocess.PIPE, text=True, check=True
    )
    visible = os.environ.get("CUDA_VISIBLE_DEVICES")
    names = visible.split(",") if visible else [str(index) for index in range(int(asked.stdout.split()[-1]))]
    return [name.strip() for name in names]
