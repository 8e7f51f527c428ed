"""Videos and pictures for the page: in the file itself while they are small, else by a link to them."""

import base64
import os
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import quote

from hcpg.report.records import Group

MEDIA_TYPES = {".mp4": "video/mp4", ".png": "image/png", ".svg": "image/svg+xml"}
EACH_BYTES = 8 * 2**20
ALL_BYTES = 64 * 2**20


class Embedding:
    """Takes files in until the page would grow too large."""

    def __init__(self, folder: Path, each_bytes: int = EACH_BYTES, all_bytes: int = ALL_BYTES) -> None:
        """For a page in `folder`, which links are relative to."""
        self.folder, self.each_bytes, self.left_bytes = folder, each_bytes, all_bytes

    def source(self, file: Path) -> dict[str, Any]:
        """`data`: the file as a data URI, or None beside `link`, where it lies from the page."""
        size = file.stat().st_size
        link = quote(os.path.relpath(file, self.folder))
        if size > min(self.each_bytes, self.left_bytes):
            return {"data": None, "link": link}
        self.left_bytes -= size
        text = base64.b64encode(file.read_bytes()).decode()
        return {"data": f"data:{MEDIA_TYPES[file.suffix]};base64,{text}", "link": link}


def videos(groups: Sequence[Group], embedding: Embedding) -> list[dict[str, Any]]:
    """Of each task and preset the newest video of every selector it was filmed with.

    Seeds come in order, so the first seed that has one is shown.
    """
    found = []
    for group in groups:
        chosen: dict[str, tuple[int, Path]] = {}
        for run in group.runs:
            for file in sorted((run.path / "videos").glob("*.mp4"), reverse=True):
                chosen.setdefault(_selector(file), (run.seed, file))
        for selector, (seed, file) in sorted(chosen.items()):
            facts = {"task": group.task, "preset": group.preset, "selector": selector, "seed": seed}
            found.append({**facts, "name": file.stem, **embedding.source(file)})
    return found


def _selector(file: Path) -> str:
    """From a name like `step_000060000_hcpg.mp4`; a video of another name stands for itself."""
    named = re.fullmatch(r"step_\d+_(.+)", file.stem)
    return named[1] if named else file.stem


def pictures(files: Iterable[Path], embedding: Embedding) -> list[dict[str, Any]]:
    """Each figure once, as SVG where there is one, with the caption that lies beside it."""
    stems = dict.fromkeys(file.with_suffix("") for file in sorted(files) if file.suffix in (".svg", ".png"))
    found = []
    for stem in stems:
        kinds = [file for suffix in (".svg", ".png") if (file := stem.with_name(stem.name + suffix)).exists()]
        caption = stem.with_name(f"{stem.name}.caption.txt")
        text = caption.read_text() if caption.exists() else ""
        found.append({"name": stem.name, "caption": text, **embedding.source(kinds[0])})
    return found
