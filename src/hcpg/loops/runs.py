"""One folder per run (one seed of one preset on one task), and all that is written into it but checkpoints.

`runs/<suite>/<task>/<preset>/s<seed>/<id>/` holds `config.json`, `manifest.json`, `status.json`,
`metrics.jsonl`, `episodes.jsonl`, `checkpoints/` and `videos/`.
"""

import fcntl
import json
import os
import secrets
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal, get_args

from hcpg.report.dotted import dotted
from hcpg.report.durable import replace_json, sync_folder
from hcpg.report.records import find_runs
from hcpg.report.rows import Row, append_rows, keep_rows_until, read_rows

Table = Literal["metrics", "episodes"]
State = Literal["running", "finished", "stopped", "diverged", "failed"]
_PARTS = ("config.json", "manifest.json", "status.json", "checkpoints", "videos")


class RunFolderError(RuntimeError):
    """A run folder that is missing, incomplete, in use or made under another configuration."""


@dataclass(frozen=True)
class RunFolder:
    """A run folder that exists; every write to it survives a kill at any moment."""

    path: Path

    @classmethod
    def create(
        cls,
        root: Path,
        *,
        task: str,
        preset: str,
        seed: int,
        config: Mapping[str, Any],
        manifest: Mapping[str, Any],
    ) -> "RunFolder":
        """A new folder under `root` with an id of its own; it appears complete or not at all.

        The manifest gets one more entry, `run`: the id, task, preset and seed.
        """
        now = datetime.now(UTC)
        run_id = f"{now:%Y%m%dT%H%M%SZ}-{secrets.token_hex(4)}"
        address = {"id": run_id, "task": task, "preset": preset, "seed": seed}
        parent = Path(root) / task / preset / f"s{seed}"
        making = cls(parent / f".making-{run_id}")
        for part in ("checkpoints", "videos"):
            (making.path / part).mkdir(parents=True)
        replace_json(making.path / "config.json", dict(config))
        replace_json(making.path / "manifest.json", {"run": address, **manifest})
        making.set_status("running", step=0)
        made = making.path.rename(parent / run_id)
        sync_folder(parent)
        return cls(made)

    @classmethod
    def open(cls, path: Path) -> "RunFolder":
        """The run folder at `path`, or the one that `path` (its checkpoint, say) lies in.

        Raises:
            RunFolderError: there is none, or a part of it is missing.
        """
        start = Path(path)
        if not start.exists():
            raise RunFolderError(f"there is nothing at {start}. Name a run folder, e.g. one under runs/.")
        near = (start, start.absolute().parent, start.absolute().parent.parent)
        found = [folder for folder in near if any((folder / part).exists() for part in _PARTS[:2])]
        if not found:
            raise RunFolderError(f"{start} is no run folder. {_inside(start)}")
        missing = [part for part in _PARTS if not (found[0] / part).exists()]
        if missing:
            raise RunFolderError(
                f"run folder {found[0]} lacks {', '.join(missing)}. "
                "Restore what was deleted, or start a new run."
            )
        return cls(found[0])

    @property
    def checkpoints(self) -> Path:
        """Where the run's checkpoints lie."""
        return self.path / "checkpoints"

    @property
    def videos(self) -> Path:
        """Where the run's videos lie."""
        return self.path / "videos"

    def config(self) -> dict[str, Any]:
        """The resolved configuration the run was started with, or last extended to."""
        return json.loads((self.path / "config.json").read_text())

    def manifest(self) -> dict[str, Any]:
        """Where the run's numbers come from: address, versions, hardware, protocol."""
        return json.loads((self.path / "manifest.json").read_text())

    def status(self) -> dict[str, Any]:
        """The last `state`, its UTC `time`, and the facts given with it."""
        return json.loads((self.path / "status.json").read_text())

    def set_config(self, config: Mapping[str, Any]) -> None:
        """Write the configuration anew, for a resume that extends the budget."""
        replace_json(self.path / "config.json", dict(config))

    def set_status(self, state: State, **facts: Any) -> None:
        """Say what became of the run, with facts that JSON can hold."""
        time = f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ}"
        replace_json(self.path / "status.json", {"state": state, "time": time, **facts})

    def append(self, name: Table, rows: Iterable[Mapping[str, Any]]) -> None:
        """Add rows, each with a `step`, in a single write.

        Raises:
            RowError: a row has no whole `step`, or a value that JSON cannot hold.
        """
        append_rows(self._table(name), rows)

    def rows(self, name: Table) -> list[Row]:
        """All rows in the order written, without a line that a kill left torn.

        Raises:
            RowError: a complete line is damaged; the message has the file and the line number.
        """
        return read_rows(self._table(name))

    def rewind(self, step: int) -> None:
        """Drop the rows past `step`: after a kill they run ahead of the checkpoint at `step`."""
        for name in get_args(Table):
            keep_rows_until(self._table(name), step)

    def check_config(self, config: Mapping[str, Any], may_differ: Iterable[str] = ("budget.steps",)) -> None:
        """Make sure that a resume runs under the run's own configuration.

        Args:
            config: the configuration asked for.
            may_differ: dotted keys (or beginnings of keys) that a resume may change.

        Raises:
            RunFolderError: other keys differ; the message has each with both values.
        """
        there, asked = dotted(self.config()), dotted(json.loads(json.dumps(config)))
        free = tuple(may_differ)
        lines = [
            f"  {key}: {there.get(key, 'absent')} in the run, {asked.get(key, 'absent')} asked for"
            for key in sorted(there.keys() | asked.keys())
            if there.get(key, "absent") != asked.get(key, "absent")
            and not any(key == name or key.startswith(f"{name}.") for name in free)
        ]
        if lines:
            raise RunFolderError(
                f"run {self.path} was made under another configuration:\n"
                + "\n".join(lines)
                + "\nResume with the run's values (its config.json), or start a new run."
            )

    @contextmanager
    def lock(self) -> Iterator[None]:
        """Hold the folder for training while the block runs.

        The kernel lets go of the lock when the process ends, however it ends; a file left behind means
        nothing. A forked child keeps the lock alive, so worker processes must be spawned.

        Raises:
            RunFolderError: a live process holds it; the message has its process id.
        """
        with (self.path / "lock").open("a+") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError as error:
                file.seek(0)
                raise RunFolderError(
                    f"process {file.read().strip()} is training in {self.path}. Wait for it or stop it first."
                ) from error
            file.truncate(0)
            file.write(f"{os.getpid()}\n")
            file.flush()
            yield

    def in_use(self) -> bool:
        """Whether a live process trains in the folder."""
        if not (self.path / "lock").exists():
            return False
        with (self.path / "lock").open() as file:
            try:
                fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
            except BlockingIOError:
                return True
        return False

    def _table(self, name: Table) -> Path:
        return self.path / f"{name}.jsonl"


def _inside(folder: Path) -> str:
    runs = find_runs(folder)
    if not runs:
        return "Name a folder that holds config.json and manifest.json."
    return f"It holds {len(runs)} of them; name one, e.g. the newest, {runs[-1]}."
