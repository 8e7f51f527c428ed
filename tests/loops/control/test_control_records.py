import numpy as np
import pytest
from point_rig import constant, episode, rows

from hcpg.loops.control.records import transitions


def test_transitions_pair_what_was_executed_with_the_next_observation(tmp_path):
    result = episode(tmp_path, horizon=10, propose=constant(1.0, 1.0, 0.0, 0.0))
    made = transitions(result.records)
    assert len(made) == result.actions == 10
    acted = [record for record in result.records if record.executed is not None]
    for transition, record in zip(made, acted, strict=True):
        following = result.records[result.records.index(record) + 1]
        assert transition.observation is record.observation
        assert transition.next_observation is following.observation
        assert transition.proposals.tolist() == [[1, 1, 0, 0]] * 4  # the proposal is kept beside it,
        assert transition.executed.tolist() == record.limited.executed.tolist()
        assert np.linalg.norm(transition.executed[:3]) <= 1 + 1e-12  # and is longer than what was done
    assert made[-1].executed.tolist() == pytest.approx([0.5**0.5, 0.5**0.5, 0, 0])


def test_a_held_tick_makes_no_transition(tmp_path):
    def sometimes(observation, count, draw):
        return np.full((count, 4), np.nan if draw % 2 else 0.1)

    result = episode(tmp_path, horizon=5, propose=sometimes)
    made = transitions(result.records)
    held = [record.verdict.cause for record in result.records if record.executed is None]
    assert len(made) == result.actions
    assert (
        held.count("the policy gave proposals that are not finite") == result.held - 4
    )  # 3 blind, 1 at the end


def test_the_log_has_every_step_and_what_was_executed(tmp_path):
    result = episode(tmp_path, horizon=6)
    logged = rows(tmp_path)
    assert [row["tick"]["number"] for row in logged] == [record.tick.number for record in result.records]
    for row, record in zip(logged, result.records, strict=True):
        executed = None if record.executed is None else record.executed.tolist()
        assert row["executed"] == executed
        assert row["snapshot"]["position"] == record.snapshot.position.tolist()
        assert (row["choice"] is None) == (record.choice is None)
        if record.choice is not None:
            assert row["choice"]["proposals"] == record.choice.proposals.tolist()
            assert row["choice"]["weights"] == record.choice.weights.tolist()


def test_the_results_row_leaves_the_records_out(tmp_path):
    row = episode(tmp_path, horizon=3).row(4)
    assert (row["kind"], row["episode"], row["ended"], row["actions"]) == ("episode", 4, "time_limit", 3)
    assert row["sound_timing"] is True
    assert "records" not in row
