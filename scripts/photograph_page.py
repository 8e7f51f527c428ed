"""Photograph a report's page in headless Chromium, at a desktop's and at a phone's width, light and dark.

Usage: photograph_page.py PAGE FOLDER. It fails if the page writes to the console or asks for anything.
"""

import argparse
import shutil
from io import BytesIO
from pathlib import Path
from typing import NamedTuple

from PIL import Image
from playwright.sync_api import Browser, Page, Playwright, sync_playwright

PATIENCE_MS = 10_000
COLORS = 256
"""Enough for a page, at less than half the bytes."""
NAMES = ("chromium", "chromium-browser", "google-chrome")


class View(NamedTuple):
    """How the page is looked at."""

    name: str
    width: int
    height: int
    scheme: str


VIEWS = (
    View("desktop", 1280, 900, "light"),
    View("desktop_dark", 1280, 900, "dark"),
    View("phone", 375, 812, "light"),
    View("phone_dark", 375, 812, "dark"),
)


def chromium(playwright: Playwright) -> str:
    """The path of a Chromium: Playwright's own, where it was downloaded, or the system's.

    Raises:
        SystemExit: there is none.
    """
    own = playwright.chromium.executable_path
    found = [own] if Path(own).exists() else [path for name in NAMES if (path := shutil.which(name))]
    if not found:
        raise SystemExit(
            f"No Chromium is installed (looked for {', '.join(NAMES)} on PATH, and for {own}). "
            "Run: scripts/install_system_packages.sh browser, or: python -m playwright install chromium"
        )
    return found[0]


def opened(browser: Browser, page: Path, view: View, complaints: list[str]) -> Page:
    """The page, looked at in that way; what it complains of or asks for is added to `complaints`."""
    size = {"width": view.width, "height": view.height}
    tab = browser.new_page(viewport=size, color_scheme=view.scheme, reduced_motion="reduce")
    tab.on("console", lambda message: complaints.append(f"console: {message.text}"))
    tab.on("pageerror", lambda error: complaints.append(f"error: {error}"))
    tab.on("request", lambda request: complaints.extend(outside(request.url)))
    tab.set_default_timeout(PATIENCE_MS)
    tab.goto(page.resolve().as_uri())
    return tab


def outside(url: str) -> list[str]:
    """The address, if it is outside the page's own folder and its own data."""
    return [] if url.startswith(("file:", "data:")) else [f"request: {url}"]


def main() -> None:
    """One picture of each view."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("page", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--views", nargs="+", choices=[view.name for view in VIEWS], help="default: all")
    asked = parser.parse_args()
    asked.folder.mkdir(parents=True, exist_ok=True)
    complaints: list[str] = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium(playwright))
        for view in (view for view in VIEWS if view.name in (asked.views or view.name)):
            tab = opened(browser, asked.page, view, complaints)
            picture = Image.open(BytesIO(tab.screenshot(full_page=True))).convert("RGB")
            picture.quantize(COLORS).save(asked.folder / f"{view.name}.png", optimize=True)
        browser.close()
    if complaints:
        raise SystemExit("\n".join(complaints))


if __name__ == "__main__":
    main()
