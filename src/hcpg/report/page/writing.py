"""One HTML file from a report's content: looks and program inlined, data as JSON, nothing fetched.

A content security policy names the hashes of the one style sheet and the one program, and allows no request:
whatever a run's files may say, the page shows it as text.
"""

import base64
import hashlib
import html
import json
import re
from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

from hcpg.report.durable import replace_file
from hcpg.report.page.content import Request, content
from hcpg.report.records import Group

STYLES = ("ground", "controls", "tables", "curves", "media")
SCRIPTS = ("dom", "tables", "results", "numbers", "curves", "contrasts", "origins", "media", "page")
"""In the order in which they use each other."""


def write_page(groups: Sequence[Group], request: Request, plain: str) -> Path:
    """Write the page to `request.out`, in one step; gives that path.

    Raises:
        RecordError: the groups do not have one protocol.
        StatisticsError: a group has fewer than five evaluations.
        StyleError: more presets than can be told apart.
    """
    replace_file(request.out, html_page(content(groups, request), plain).encode())
    return request.out


def html_page(shown: Mapping[str, Any], plain: str) -> str:
    """The whole file; `plain` is shown where JavaScript is switched off.

    Raises:
        ValueError: a number is not finite (JSON has no word for it).
    """
    style = "\n".join(_asset(f"{name}.css") for name in STYLES)
    # A function of its own: its names must not meet the browser's.
    script = "\n".join(["(() => {", *(_asset(f"{name}.js") for name in SCRIPTS), "})();"])
    policy = (
        f"default-src 'none'; style-src '{_digest(style)}'; script-src '{_digest(script)}'; "
        "img-src data:; media-src data:; base-uri 'none'; form-action 'none'"
    )
    parts = {
        "policy": policy,
        "title": html.escape(shown["title"]),
        "plain": html.escape(plain),
        "style": style,
        "data": _inert(shown),
        "script": script,
    }
    # In one pass: what a part says is not looked through for other parts' places.
    return re.sub(r"\{\{(\w+)\}\}", lambda place: parts[place[1]], _asset("page.html"))


def _asset(name: str) -> str:
    return files("hcpg.report.page").joinpath(name).read_text(encoding="utf-8")


def _digest(text: str) -> str:
    return f"sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}"


def _inert(shown: Mapping[str, Any]) -> str:
    """JSON that no HTML parser finds a tag or a comment in."""
    text = json.dumps(shown, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
