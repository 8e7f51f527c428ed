"""A folder of demonstrations: what an arm carried out while somebody showed a task, and where it comes from.

`manifest.json` says task, robot, source, limits and the SHA-256 of every file, its own too; each kept episode
is an `episode_000.npz` of plain arrays. What is read is what was written, or it is refused.
"""

import hashlib
import io
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hcpg.loops.control.experience import Experience
from hcpg.report.durable import json_digest, replace_file, replace_json
from hcpg.types import Batch, Float

FORMAT = 1
MANIFEST = "manifest.json"


class DemonstrationError(RuntimeError):
    """Demonstrations that cannot be written or used; the message says why and the cure."""


class Demonstrations(NamedTuple):
    """What a folder holds."""

    path: Path
    manifest: Mapping[str, Any]
    batch: Batch
    """All actions of all kept episodes, in order, as NumPy arrays; each episode ends with a success."""

    @property
    def digest(self) -> str:
        """The SHA-256 that names exactly these demonstrations."""
        return self.manifest["sha256"]


class DemonstrationFolder:
    """Written while it is recorded: what is in the manifest is on the disk, whenever the recording ends."""

    def __init__(self, path: Path, facts: Mapping[str, Any]) -> None:
        """Make the folder; `facts` (`task` among them) go into its manifest.

        Raises:
            DemonstrationError: there is something already.
        """
        if path.exists() and any(path.iterdir()):
            raise DemonstrationError(f"{path} is not empty. Record into a new folder.")
        path.mkdir(parents=True, exist_ok=True)
        self.path = path
        self._manifest = {"format": FORMAT, **facts, "episodes": [], "not_kept": []}
        self._write()

    @property
    def kept(self) -> int:
        """Episodes kept so far."""
        return len(self._manifest["episodes"])

    def add(self, episode: Experience) -> None:
        """Keep an episode that succeeded; of another one, keep only that it was."""
        facts = {"start": episode.start, "ended": episode.ended, "actions": episode.actions}
        if not episode.success:
            self._manifest["not_kept"].append(facts)
        else:
            content = _packed(episode.batch)
            name = f"episode_{self.kept:03d}.npz"
            replace_file(self.path / name, content)
            self._manifest["episodes"].append(
                {"file": name, "sha256": hashlib.sha256(content).hexdigest(), **facts}
            )
        self._write()

    def _write(self) -> None:
        replace_json(self.path / MANIFEST, {**self._manifest, "sha256": json_digest(self._manifest)})


def load(path: Path, task: str) -> Demonstrations:
    """The demonstrations of `task` in the folder `path`.

    Raises:
        DemonstrationError: there are none, they are another task's, or a file was altered.
    """
    manifest = _manifest(path)
    if manifest["task"] != task:
        raise DemonstrationError(
            f"the demonstrations in {path} are of {manifest['task']}, not of {task}. "
            f"Give those of {task}, or record some: hcpg robot demos {task} --help"
        )
    if not manifest["episodes"]:
        raise DemonstrationError(f"no demonstration in {path} succeeded; record others.")
    parts = [_episode(path, facts) for facts in manifest["episodes"]]
    return Demonstrations(path, manifest, Batch(*map(np.concatenate, zip(*parts, strict=True))))


def task_of(path: Path) -> str:
    """Which task the demonstrations in the folder show.

    Raises:
        DemonstrationError: there is no whole manifest.
    """
    return _manifest(path)["task"]


def _manifest(path: Path) -> dict[str, Any]:
    file = path / MANIFEST
    if not file.is_file():
        raise DemonstrationError(f"{path} holds no demonstrations (it has no {MANIFEST}).")
    manifest = json.loads(file.read_text())
    told = manifest.pop("sha256", None)
    if told != json_digest(manifest):
        raise DemonstrationError(f"{file} was altered (its SHA-256 is another); restore it from a copy.")
    if manifest["format"] != FORMAT:
        raise DemonstrationError(f"{file} has format {manifest['format']}; this version reads {FORMAT}.")
    return {**manifest, "sha256": told}


def _packed(batch: Batch) -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, allow_pickle=False, **batch._asdict())
    return buffer.getvalue()


def _episode(path: Path, facts: Mapping[str, Any]) -> tuple[Float[np.ndarray, "..."], ...]:
    file = path / facts["file"]
    content = file.read_bytes() if file.is_file() else b""
    if hashlib.sha256(content).hexdigest() != facts["sha256"]:
        raise DemonstrationError(f"{file} is missing or was altered; restore it from a copy.")
    with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
        return tuple(arrays[name] for name in Batch._fields)
