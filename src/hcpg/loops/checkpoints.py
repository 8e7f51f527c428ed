"""Checkpoints that are whole or not there: safetensors and JSON, written beside and renamed, never pickle.

`checkpoints/step_000012000/` holds one `<tree>.safetensors` per tree, its arrays named by their key path, and
`facts.json`: format version, step, the caller's facts, and per file the SHA-256, the size and every array's
shape and type. `facts.json` carries its own SHA-256, so any altered byte is found.
"""

import hashlib
import json
import logging
import shutil
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.tree_util import keystr, tree_flatten_with_path, tree_map_with_path
from safetensors.numpy import load_file, save_file

from hcpg.report.durable import json_digest, replace_json, sync_file, sync_folder

PyTree = Any
FORMAT = 1
_LOG = logging.getLogger(__name__)


class CheckpointError(RuntimeError):
    """A checkpoint that is damaged or does not fit; the message says which part and what to do."""


def save(
    folder: Path, step: int, trees: Mapping[str, PyTree], facts: Mapping[str, Any], keep: int = 2
) -> Path:
    """Write a checkpoint of `trees` at environment step `step` and give its folder.

    Of the older ones the newest `keep - 1` stay; later ones, left by a training that was taken up again
    at an earlier step, go. Nothing is deleted before the new checkpoint is complete on the disk. One process
    at a time may save into a folder (`RunFolder.lock`).

    Args:
        folder: where the run's checkpoints lie.
        step: environment steps so far.
        trees: pytrees by name. Arrays are saved (JAX, NumPy, typed keys); other leaves come back from the
            template at `load`. An array in C order is written without a copy.
        facts: what JSON can hold: counters, generator states. Tuples come back as lists.
        keep: how many checkpoints remain.

    Raises:
        ValueError: a fact is not a finite number.
        TypeError: a fact is nothing JSON can hold.
    """
    for leftover in folder.glob(".*"):
        shutil.rmtree(leftover)
    target = folder / f"step_{step:09d}"
    writing = folder / f".writing-{target.name}"
    writing.mkdir(parents=True)
    files = {name: _write_tree(writing / f"{name}.safetensors", tree) for name, tree in trees.items()}
    document = {"format": FORMAT, "step": step, "facts": dict(facts), "files": files}
    replace_json(writing / "facts.json", {**document, "sha256": json_digest(document)})
    _publish(writing, target)
    _prune(folder, target, keep)
    return target


def latest(folder: Path, not_after: int | None = None) -> Path | None:
    """The newest checkpoint whose every byte is as written; None if none was ever completed.

    Args:
        folder: where the run's checkpoints lie.
        not_after: a step; later checkpoints do not count. A kill may leave the runs of a population one
            checkpoint apart: the newest step that all have is the smallest of their newest ones.

    Raises:
        CheckpointError: there are checkpoints, and all are damaged.
    """
    reasons = []
    for path in reversed(_published(folder)):
        if not_after is not None and step_of(path) > not_after:
            continue
        reason = damage(path)
        if reason is None:
            return path
        reasons.append(f"{path.name}: {reason}")
        _LOG.warning("passed over checkpoint %s: %s", path, reason)
    if reasons:
        raise CheckpointError(
            f"every checkpoint in {folder} is damaged ({'; '.join(reasons)}). "
            "Restore one from a copy, or start a new run."
        )
    return None


def step_of(checkpoint: Path) -> int:
    """The environment step a checkpoint was made at, from its name."""
    return int(checkpoint.stem.removeprefix("step_"))


def damage(path: Path, names: Iterable[str] | None = None) -> str | None:
    """What is wrong with the checkpoint's files (those of the trees `names`, or all); None if nothing is."""
    document = _document(path)
    if document is None:
        return "facts.json is missing or altered"
    if document["format"] != FORMAT:
        return f"it has format {document['format']}, this version reads format {FORMAT}"
    files = document["files"]
    for name in files if names is None else names:
        if name not in files:
            return f"it holds no tree {name!r}, only {', '.join(sorted(files))}"
        reason = _file_damage(path / f"{name}.safetensors", files[name])
        if reason is not None:
            return reason
    return None


def load(path: Path, templates: Mapping[str, PyTree]) -> tuple[dict[str, PyTree], dict[str, Any]]:
    """The trees named in `templates`, in the templates' structure, and the facts.

    An array comes back as what the template holds there, JAX or NumPy, bit for bit.

    Raises:
        CheckpointError: a file is missing, truncated or altered; or an array is missing, left over, or of
            another shape or type than in the template.
    """
    document = _checked(path, templates)
    trees = {}
    for name, template in templates.items():
        _check_fit(path, name, template, document["files"][name])
        trees[name] = _filled(template, load_file(path / f"{name}.safetensors"))
    return trees, document["facts"]


def trees(path: Path) -> frozenset[str]:
    """The names of the trees that the checkpoint holds.

    Raises:
        CheckpointError: its facts are missing or altered.
    """
    return frozenset(_checked(path, [])["files"])


def load_raw(path: Path, name: str) -> dict[str, np.ndarray]:
    """The arrays of one tree by key path, whatever their shapes (a replay saved only as far as filled).

    Raises:
        CheckpointError: the tree's file is missing, truncated or altered.
    """
    _checked(path, [name])
    return load_file(path / f"{name}.safetensors")


def _write_tree(path: Path, tree: PyTree) -> dict[str, Any]:
    arrays = {key: _stored(leaf) for key, leaf in _leaves(tree) if eqx.is_array(leaf)}
    save_file(arrays, path)
    sync_file(path)
    return {"sha256": _file_digest(path), "bytes": path.stat().st_size, **_description(tree)}


def _publish(writing: Path, target: Path) -> None:
    """Rename into place; one already there steps aside under a name that `latest` still finds."""
    sync_folder(writing)
    if target.exists():
        aside = target.with_name(f"{target.name}.replaced")
        if aside.exists():
            shutil.rmtree(aside)
        target.rename(aside)
    writing.rename(target)
    sync_folder(target.parent)


def _prune(folder: Path, newest: Path, keep: int) -> None:
    published = _published(folder)
    place = published.index(newest)
    kept = [path for path in published[: place + 1] if path.suffix != ".replaced"][-keep:]
    for path in published:
        if path not in kept:
            # Hidden before it is emptied: a half-deleted folder must not look like a damaged checkpoint.
            shutil.rmtree(path.rename(folder / f".deleting-{path.name}"))


def _published(folder: Path) -> list[Path]:
    """Oldest first; the replaced one of a step counts as older than the one that replaced it."""
    return sorted(folder.glob("step_*"), key=lambda path: (path.stem, path.suffix == ""))


def _document(path: Path) -> dict[str, Any] | None:
    file = path / "facts.json"
    if not file.is_file():
        return None
    try:
        document = json.loads(file.read_bytes())
    except ValueError:
        return None
    if not isinstance(document, dict) or document.pop("sha256", None) != json_digest(document):
        return None
    return document


def _file_digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _file_damage(path: Path, expected: Mapping[str, Any]) -> str | None:
    if not path.is_file():
        return f"{path.name} is missing"
    size = path.stat().st_size
    if size != expected["bytes"]:
        return f"{path.name} has {size} bytes instead of {expected['bytes']}"
    if _file_digest(path) != expected["sha256"]:
        return f"{path.name} was altered (its SHA-256 is another)"
    return None


def _checked(path: Path, names: Iterable[str]) -> dict[str, Any]:
    reason = damage(path, names)
    document = _document(path)
    if reason is not None or document is None:
        raise CheckpointError(
            f"checkpoint {path} cannot be loaded: {reason}. "
            f"Take another checkpoint from {path.parent}, or restore this one from a copy."
        )
    return document


def _check_fit(path: Path, name: str, template: PyTree, stored: Mapping[str, Any]) -> None:
    wanted = _description(template)
    lines = []
    for part in ("arrays", "constants"):
        there, here = stored[part], wanted[part]
        lines += [
            f"  {name}{key}: {there.get(key, 'absent')} in the checkpoint, {here.get(key, 'absent')} expected"
            for key in sorted(there.keys() | here.keys())
            if there.get(key) != here.get(key)
        ]
    if lines:
        raise CheckpointError(
            f"checkpoint {path} does not fit:\n"
            + "\n".join(lines)
            + "\nLoad it under the configuration it was made with (the run's config.json)."
        )


def _description(tree: PyTree) -> dict[str, dict[str, str]]:
    """What a tree must have for a checkpoint to fit: arrays by type and shape, plain values as they are."""
    leaves = _leaves(tree)
    plain = (bool, int, float, complex, str)
    return {
        "arrays": {key: f"{leaf.dtype}{list(leaf.shape)}" for key, leaf in leaves if eqx.is_array(leaf)},
        "constants": {key: repr(leaf) for key, leaf in leaves if type(leaf) in plain},
    }


def _leaves(tree: PyTree) -> list[tuple[str, Any]]:
    return [(keystr(key), leaf) for key, leaf in tree_flatten_with_path(tree)[0]]


def _is_key(leaf: Any) -> bool:
    return isinstance(leaf, jax.Array) and jnp.issubdtype(leaf.dtype, jax.dtypes.prng_key)


def _stored(leaf: Any) -> np.ndarray:
    return np.asarray(jax.random.key_data(leaf) if _is_key(leaf) else leaf, order="C")


def _filled(template: PyTree, arrays: Mapping[str, np.ndarray]) -> PyTree:
    return tree_map_with_path(lambda key, leaf: _restored(leaf, arrays.get(keystr(key))), template)


def _restored(leaf: Any, array: np.ndarray | None) -> Any:
    if array is None:
        return leaf
    if _is_key(leaf):
        return jax.random.wrap_key_data(jnp.array(array), impl=jax.random.key_impl(leaf))
    if isinstance(leaf, jax.Array):
        return jnp.array(array)
    return array[()] if isinstance(leaf, np.generic) else array
