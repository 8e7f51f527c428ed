"""Worked by hand: what the critic expected, what came of it, and what it counted for entropy."""

import json

import numpy as np
import pytest

from hcpg.report.records import load_run
from hcpg.report.stability import appraisal, table

BARE = [
    {"selector": "bare", "value": 12.0, "discounted_return": 3.0, "success_once": True},
    {"selector": "bare", "value": 14.0, "discounted_return": 5.0, "success_once": False},
]
OTHER = {"selector": "hcpg", "value": 100.0, "discounted_return": 100.0, "success_once": True}


def test_the_bias_is_what_neither_rewards_nor_entropy_account_for():
    """0.75 / 0.25 * 0.5 * 4 nats = 6 for entropy; 13 - 6 - 4 = 3."""
    found = appraisal([OTHER, *BARE], {"temperature": 0.5, "path_entropy": 4.0}, discount=0.75)
    assert found == (13.0, 4.0, 6.0)
    assert found.bias == 3.0


@pytest.mark.parametrize("metrics", [{}, {"temperature": None, "entropy": None}, {"temperature": 0.2}])
def test_where_nothing_pays_for_entropy_nothing_is_taken_off(metrics):
    assert appraisal(BARE, metrics, discount=0.75).bias == 9.0


def test_rows_that_do_not_say_give_nan():
    found = appraisal([{"selector": "bare", "success_once": True}], {}, discount=0.75)
    assert np.isnan([found.value, found.discounted_return, found.bias]).all()


def test_each_evaluation_stands_beside_the_metrics_logged_before_it(write_run):
    path = write_run(success=[2, 9], bare=[1, 8])
    lines = (path / "metrics.jsonl").read_text().splitlines()
    rows = [json.loads(line) | {"temperature": 0.5 / (place + 1)} for place, line in enumerate(lines)]
    (path / "metrics.jsonl").write_text("".join(json.dumps(row) + "\n" for row in rows))
    config = json.loads((path / "config.json").read_text())
    (path / "config.json").write_text(json.dumps({**config, "learner": {"discount": 0.5}}))
    cells = [[cell.strip() for cell in line.split("|")[1:-1]] for line in table(load_run(path)).splitlines()]
    assert cells[0][:4] == ["step", "success", "bare", "value"]
    column = cells[0].index("temperature")
    temperature = {row["step"]: row["temperature"] for row in rows}
    assert [(line[0], line[1], line[2], line[3]) for line in cells[2:]] == [
        ("100", "20", "10", "-"),
        ("200", "90", "80", "-"),
    ]
    assert [float(line[column]) for line in cells[2:]] == pytest.approx(
        [temperature[100], temperature[200]], rel=1e-2
    )
