"""What one job trains: on a CPU one run, on an accelerator the seeds of a configuration together."""

from collections.abc import Hashable
from pathlib import Path
from typing import NamedTuple

from hcpg.experiments.ledger import Entry, newest_checkpoint
from hcpg.experiments.protocols import Cell
from hcpg.presets import Settings, differences


class Unit(NamedTuple):
    """Runs of one configuration, all of them new or all to be resumed from the same step."""

    entries: tuple[Entry, ...]

    @property
    def settings(self) -> Settings:
        """The configuration of all of them."""
        return self.entries[0].cell.settings

    @property
    def cells(self) -> list[Cell]:
        """The cells they are the runs of."""
        return [entry.cell for entry in self.entries]

    @property
    def folders(self) -> list[Path]:
        """The run folders to go on in; none for new runs."""
        return [entry.folder for entry in self.entries if entry.folder is not None]

    @property
    def label(self) -> str:
        """The unit in a few words."""
        seeds = " ".join(f"s{entry.cell.seed}" for entry in self.entries)
        return f"{self.settings.task} {self.settings.preset} {seeds}"

    @property
    def log(self) -> Path:
        """Where the output of its process goes, from the results folder on."""
        return Path("logs") / f"{self.label.replace('/', '-').replace(' ', '_')}.txt"


def units(entries: list[Entry], together: bool) -> list[Unit]:
    """The entries as units, in the order of their first ones: one each, or the seeds `together`."""
    groups: dict[Hashable, list[Entry]] = {}
    for index, entry in enumerate(entries):
        groups.setdefault(_position(entry) if together else index, []).append(entry)
    return [Unit(tuple(group)) for group in groups.values()]


def command(unit: Unit, results: Path) -> list[str]:
    """The `hcpg` arguments that make or continue the unit's runs."""
    if unit.folders:
        return ["train", "--resume", *map(str, unit.folders)]
    chosen = unit.settings
    names = ["--task", chosen.task, "--preset", chosen.preset, "--budget", chosen.budget.name]
    places = ["--seeds", *(str(cell.seed) for cell in unit.cells), "--out", str(results)]
    return ["train", *names, *places, *differences(chosen)]


def _position(entry: Entry) -> Hashable:
    """What entries must share to be trained together: the configuration, and where they go on from."""
    config, _ = entry.cell.identity()
    return config, entry.folder is not None, newest_checkpoint(entry.folder) if entry.folder else None
