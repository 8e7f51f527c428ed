"""Nested settings by dotted key."""

from hcpg.report.dotted import dotted


def test_leaves_have_dotted_keys_and_values_as_json():
    tree = {"budget": {"name": "cpu", "inner": {"steps": 3}}, "bounds": [-1.0, 1.0], "top": None, "empty": {}}
    assert dotted(tree) == {
        "budget.name": '"cpu"',
        "budget.inner.steps": "3",
        "bounds": "[-1.0, 1.0]",
        "top": "null",
    }
