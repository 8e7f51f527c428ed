"""An exported policy's folder: written whole or not at all, and read only if every byte is as written.

`weights.safetensors` holds the arrays, `policy.json` what they are, `README.md` the model card, and
`manifest.json` the size and SHA-256 of each, and its own SHA-256. What is read are numbers and JSON: no code,
no pickle. The manifest finds damage and mix-ups; against somebody who writes a new one, give `read` the
digest that `hcpg export` printed.
"""

import hashlib
import json
import secrets
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from safetensors.numpy import load, save

from hcpg.report.durable import replace_file, sync_folder

FORMAT = 1
MANIFEST, POLICY, WEIGHTS, CARD = "manifest.json", "policy.json", "weights.safetensors", "README.md"
AGAIN = "Copy the folder anew, or export the run again: hcpg export RUN"


class PolicyFolderError(RuntimeError):
    """A folder that holds no sound policy; the message says which part and what to do."""


class Parcel(NamedTuple):
    """What a policy's folder holds."""

    facts: Mapping[str, Any]
    """Of `policy.json`."""
    arrays: Mapping[str, np.ndarray]
    digest: str
    """SHA-256 that stands for the whole folder."""


def write(folder: Path, facts: Mapping[str, Any], arrays: Mapping[str, np.ndarray], card: str) -> str:
    """Make the folder with its four files, in one step, and give its digest.

    Raises:
        PolicyFolderError: there is something of that name already.
        ValueError: a fact is not a finite number.
    """
    if folder.exists():
        raise PolicyFolderError(f"{folder} exists; remove it, or name another place with --out")
    contents = {
        POLICY: _json(facts),
        WEIGHTS: save({name: np.ascontiguousarray(array) for name, array in arrays.items()}),
        CARD: card.encode(),
    }
    document = {"format": FORMAT, "files": {name: _facts(content) for name, content in contents.items()}}
    contents[MANIFEST] = _json({**document, "sha256": _digest(document)})
    making = folder.with_name(f".making-{folder.name}-{secrets.token_hex(4)}")
    making.mkdir(parents=True)
    for name, content in contents.items():
        replace_file(making / name, content)
    making.rename(folder)
    sync_folder(folder.parent)
    return _digest(document)


def read(folder: Path, digest: str | None = None) -> Parcel:
    """What the folder holds, each file read once; given a `digest`, that folder and no other.

    Raises:
        PolicyFolderError: a file is missing, cut short or altered; or the folder is of another format or has
            another digest.
    """
    document = _manifest(folder)
    found = document["sha256"]
    if digest is not None and digest != found:
        raise PolicyFolderError(f"{folder} has the digest {found}, not {digest}: another policy. {AGAIN}")
    contents = {name: _content(folder, name, expected) for name, expected in document["files"].items()}
    return Parcel(json.loads(contents[POLICY]), load(contents[WEIGHTS]), found)


def _manifest(folder: Path) -> dict[str, Any]:
    file = folder / MANIFEST
    if not file.is_file():
        raise PolicyFolderError(f"{folder} is no exported policy: it has no {MANIFEST}. {AGAIN}")
    try:
        document = json.loads(file.read_bytes())
    except ValueError as error:
        raise PolicyFolderError(f"{file} is damaged ({error}). {AGAIN}") from error
    if not isinstance(document, dict) or document.get("sha256") != _digest(_without_digest(document)):
        raise PolicyFolderError(f"{file} was altered (its SHA-256 is another). {AGAIN}")
    if document.get("format") != FORMAT:
        told = f"{folder} has format {document.get('format')}, and this version reads format {FORMAT}"
        raise PolicyFolderError(f"{told}. Install the version that exported it, or export the run again.")
    if set(document["files"]) != {POLICY, WEIGHTS, CARD}:
        raise PolicyFolderError(f"{file} names the files {', '.join(document['files'])}. {AGAIN}")
    return document


def _content(folder: Path, name: str, expected: Mapping[str, Any]) -> bytes:
    file = folder / name
    if not file.is_file():
        there = ", ".join(sorted(each.name for each in folder.iterdir()))
        raise PolicyFolderError(f"{folder} lacks {name}; there are {there}. {AGAIN}")
    content = file.read_bytes()
    if len(content) != expected["bytes"]:
        raise PolicyFolderError(f"{file} has {len(content)} bytes instead of {expected['bytes']}. {AGAIN}")
    if _facts(content) != expected:
        raise PolicyFolderError(f"{file} was altered (its SHA-256 is another). {AGAIN}")
    return content


def _facts(content: bytes) -> dict[str, Any]:
    return {"bytes": len(content), "sha256": hashlib.sha256(content).hexdigest()}


def _digest(document: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(document, sort_keys=True).encode()).hexdigest()


def _without_digest(document: Mapping[str, Any]) -> dict[str, Any]:
    return {name: part for name, part in document.items() if name != "sha256"}


def _json(value: Mapping[str, Any]) -> bytes:
    return json.dumps(value, indent=2, allow_nan=False).encode() + b"\n"
