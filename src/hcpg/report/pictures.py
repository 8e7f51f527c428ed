"""A figure as files: PNG, SVG and PDF that carry where they come from, and a caption beside them."""

from pathlib import Path
from typing import TYPE_CHECKING

import hcpg
from hcpg.report.provenance import Provenance
from hcpg.report.styles import drawing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PIXELS_PER_IN = 300


def save(figure: "Figure", stem: Path, caption: str, origin: Provenance) -> list[Path]:
    """Write `stem`.png, .svg, .pdf and .caption.txt; gives the four paths.

    The same figure gives the same bytes: no file holds a date.
    """
    stem.parent.mkdir(parents=True, exist_ok=True)
    title, source, made = stem.name, origin.text(), f"hcpg {hcpg.__version__}"
    facts = {
        "png": {"Title": title, "Description": caption, "Comment": source, "Software": made},
        "svg": {
            "Title": title,
            "Description": caption,
            "Source": source,
            "Creator": made,
            "Date": None,
        },
        "pdf": {"Title": title, "Subject": caption, "Keywords": source, "Creator": made},
    }
    facts["pdf"] |= {"CreationDate": None}
    paths = []
    with drawing():
        figure.draw_without_rendering()
        figure.set_layout_engine("none")  # laid out once: it takes longer than writing a file
        for kind, metadata in facts.items():
            paths.append(stem.with_name(f"{stem.name}.{kind}"))
            figure.savefig(paths[-1], dpi=PIXELS_PER_IN, metadata=metadata)
    paths.append(stem.with_name(f"{stem.name}.caption.txt"))
    paths[-1].write_text(caption_text(caption, origin))
    return paths


def caption_text(caption: str, origin: Provenance) -> str:
    """The caption, and below it a line each for what it was made by and from."""
    lines = {"made by": origin.command, "commit": origin.commit, **origin.facts}
    return "\n".join([caption, "", *(f"{name}: {value}" for name, value in lines.items())]) + "\n"
