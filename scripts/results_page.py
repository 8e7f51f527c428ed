"""Write docs/results.md anew from the runs stored under results/.

Usage: results_page.py ; every number follows from the stored rows, and a test compares the page with them.
"""

from pathlib import Path

from hcpg.experiments.results_page import page

ROOT = Path(__file__).parents[1]
MARK = "<!-- From here on written by scripts/results_page.py. -->\n\n"


def main() -> None:
    """Keep what stands before the mark, and write what follows it."""
    file = ROOT / "docs/results.md"
    head = file.read_text().partition(MARK)[0]
    file.write_text(head + MARK + page(ROOT / "results"))


if __name__ == "__main__":
    main()
