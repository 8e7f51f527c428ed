"""What may stand together: facts that all have alike, and refusals that name what differs."""

import json

import pytest

from hcpg.report.protocol import one_protocol, protocol, shared
from hcpg.report.records import RecordError, load_runs


def test_facts_that_all_have_alike():
    assert shared([("a", {"x": "1", "y": "2"}), ("b", {"x": "1", "y": "2"})]) == {"x": "1", "y": "2"}


@pytest.mark.parametrize(
    ("second", "message"),
    [({"x": "3"}, r"cannot mix x \(1: a; 3: b\)"), ({}, r"cannot mix x \(1: a; absent: b\)")],
)
def test_facts_that_differ_are_named_with_their_owners(second, message):
    with pytest.raises(RecordError, match=message):
        shared([("a", {"x": "1"}), ("b", second)])


def test_a_groups_facts(write_run, tmp_path):
    write_run(seed=1, bare=[1, 2])
    write_run(seed=0, bare=[1, 2, 3])
    assert protocol(*load_runs([tmp_path])) == {
        "budget": "cpu",
        "steps": "200",
        "adapter": "paper",
        "evaluation episodes": "10",
        "seeds": "0 1",
    }


def test_seeds_of_one_preset_under_different_settings_are_refused(write_run, tmp_path):
    write_run(seed=0, bare=[1])
    other = write_run(seed=1, bare=[1])
    (other / "config.json").write_text('{"budget": {"name": "cpu"}, "learner": {"discount": 0.9}}')
    with pytest.raises(
        RecordError, match=r"learner\.discount \(absent: p on point/reach s0; 0\.9: p on point/reach s1\)"
    ):
        protocol(*load_runs([tmp_path]))


def test_budgets_of_one_name_but_other_values_are_refused(write_run, tmp_path):
    for preset, rate in (("a", 0.5), ("b", 0.25)):
        path = write_run(preset=preset, bare=[1])
        budget = {"name": "cpu", "updates_per_step": rate}
        (path / "config.json").write_text(json.dumps({"budget": budget}))
    with pytest.raises(RecordError, match=r"budget\.updates_per_step \(0\.5: a on point/reach; 0\.25: b on"):
        one_protocol(load_runs([tmp_path]))
