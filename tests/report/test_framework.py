"""The overview: the committed file is what the code draws, and its numbers follow from the equations."""

import math
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from hcpg.report.framework import considered, framework_svg
from hcpg.report.svg import arrow, document, text

FILE = Path(__file__).parents[2] / "docs/framework.svg"


def test_the_committed_file_is_what_the_code_draws():
    assert FILE.read_text() == framework_svg(), "run scripts/draw_framework.py"


def test_the_numbers_are_the_papers_equations_by_hand():
    # Before contact the target is (0.2, -0.18) in x, z. The second proposal is (0.45, -0.85).
    along = (0.45 * 0.2 + 0.85 * 0.18) / math.hypot(0.2, 0.18)
    scores = considered(0.0).diagnostics.scores
    assert scores[1] == pytest.approx(along - 0.05 * math.hypot(0.45, 0.85))
    mean = sum(scores) / 4
    deviation = math.sqrt(sum((score - mean) ** 2 for score in scores) / 4)
    powers = [math.exp((score - mean) / deviation / 0.7) for score in scores]
    weights = [power / sum(powers) for power in powers]
    assert considered(0.0).diagnostics.weights == pytest.approx(weights)
    drawn = {each.text for each in ET.fromstring(framework_svg()).iter("{http://www.w3.org/2000/svg}text")}
    assert {f"{score:+.2f}" for score in scores} | {f"{weight:.2f}" for weight in weights} < drawn


def test_contact_switches_which_proposal_leads():
    assert considered(0.0).diagnostics.weights.argmax() == 1
    assert considered(1.0).diagnostics.weights.argmax() == 3


def test_shapes_are_sound_svg():
    drawn = document(10, 5, "a < b", [arrow([(0, 0), (1, 2)], "#123456"), text((1, 1), "x & y")])
    root = ET.fromstring(drawn)
    assert root.get("viewBox") == "0 0 10 5"
    [marker] = root.iter("{http://www.w3.org/2000/svg}marker")
    [path] = [each for each in root.iter("{http://www.w3.org/2000/svg}path") if each.get("marker-end")]
    assert path.get("marker-end") == f"url(#{marker.get('id')})"
