"""Colours of the figures, to be read on white and on black."""

from hcpg.report.page.looks import looks


def luminance(color):
    """WCAG's relative luminance."""
    parts = [int(color[place : place + 2], 16) / 255 for place in (1, 3, 5)]
    linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def test_ours_keeps_its_blue_and_its_circle():
    assert looks(["sac", "hcpg_flow"])["hcpg_flow"] == {
        "on_white": "#0072B2",
        "on_black": "#4AA8E8",
        "shape": "circle",
    }


def test_every_colour_stands_out_from_its_ground():
    """A contrast of 2 for lines: Okabe and Ito's orange has 2.2 on white, the pale yellow had 1.3."""
    names = ["sac", "flowrl", "qsm", "sac_flow", "hcpg_flow", *(f"other {number}" for number in range(9))]
    for look in looks(names).values():
        assert 1.05 / (luminance(look["on_white"]) + 0.05) > 2
        assert (luminance(look["on_black"]) + 0.05) / (luminance("#191C22") + 0.05) > 4.5
