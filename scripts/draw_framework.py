"""Draw the overview of HCPG-Flow into docs/framework.svg; a test holds the file to the code."""

from pathlib import Path

from hcpg.report.framework import framework_svg

FILE = Path(__file__).resolve().parents[1] / "docs/framework.svg"

if __name__ == "__main__":
    FILE.write_text(framework_svg())
