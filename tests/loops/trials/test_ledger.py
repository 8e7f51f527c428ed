"""The ledger: nothing dropped, nothing repeated unasked, nobody else's plan."""

import json
from dataclasses import replace

import pytest
from trial_cases import plan

from hcpg.loops.trials.ledger import CUT_OFF, Ledger, LedgerError
from hcpg.loops.trials.plan import slots
from hcpg.report.trial_records import LEDGER, PLAN, RecordError, read_study

SOUND = {"ended": "success", "cause": "success", "invalid": "", "detector": True, "steps": 9, "referee": True}


def finish(ledger, **changed):
    """The next attempt, begun and ended."""
    turn = ledger.next()
    ledger.begin(turn)
    ledger.end(turn, {**SOUND, **changed})
    return turn.slot.number, turn.attempt


def test_each_trial_comes_once_and_in_order(tmp_path):
    with Ledger(tmp_path, plan()) as ledger:
        assert [finish(ledger) for _ in range(4)] == [(1, 1), (2, 1), (3, 1), (4, 1)]
        assert ledger.next() is None


def test_it_goes_on_where_it_stopped(tmp_path):
    with Ledger(tmp_path, plan()) as ledger:
        finish(ledger)
    with Ledger(tmp_path, plan()) as ledger:
        assert [finish(ledger) for _ in range(3)] == [(2, 1), (3, 1), (4, 1)]
        assert ledger.next() is None
    written = read_study(tmp_path).attempts
    assert [each.code for each in written] == [slot.code for slot in slots(plan())]


def test_an_invalid_trial_is_repeated_once_and_stays_written_down(tmp_path):
    with Ledger(tmp_path, plan()) as ledger:
        invalid = {"invalid": "the camera was lost"}
        assert [finish(ledger, **invalid), finish(ledger, **invalid), finish(ledger)] == [
            (1, 1),
            (1, 2),
            (2, 1),
        ]
    study = read_study(tmp_path)
    assert [each.invalid for each in study.attempts] == ["the camera was lost"] * 2 + [""]
    assert sum(len(study.counted(name)) for name in study.policies) == 1


def test_a_trial_that_was_cut_off_does_not_count_and_is_repeated(tmp_path):
    with Ledger(tmp_path, plan()) as ledger:
        ledger.begin(ledger.next())
    with Ledger(tmp_path, plan()) as ledger:
        assert ledger.attempts[0].invalid == CUT_OFF
        assert finish(ledger) == (1, 2)
        assert finish(ledger) == (2, 1)


def test_what_the_operator_says_may_make_it_invalid(tmp_path):
    with Ledger(tmp_path, plan()) as ledger:
        turn = ledger.next()
        ledger.begin(turn)
        ledger.end(turn, {**SOUND, "to_judge": True})
        assert [each.slot.number for each in ledger.unjudged()] == [1]
        ledger.judge(turn, None, "the operator: the cable was caught")
        assert ledger.unjudged() == []
        assert ledger.next()[1] == 2
        finish(ledger, to_judge=True)
        ledger.judge(ledger.unjudged()[0], False, "")
        first, second = ledger.attempts
        assert (first.invalid, first.operator) == ("the operator: the cable was caught", None)
        assert (second.invalid, second.operator) == ("", False)
        assert second.disagreement == "detector: done, operator: not done, physics: done"


def test_another_plan_is_refused_with_what_differs(tmp_path):
    with Ledger(tmp_path, plan()) as ledger:
        finish(ledger)
    changed = replace(plan(), policies={"a": {"sha256": "other"}, "b": plan().policies["b"]})
    with pytest.raises(
        LedgerError, match=r'policies\.a\.sha256: "digest of a" in the plan, "other" asked for'
    ):
        Ledger(tmp_path, changed)


def test_a_plan_that_somebody_altered_is_refused(tmp_path):
    Ledger(tmp_path, plan())
    document = json.loads((tmp_path / PLAN).read_text())
    document["plan"]["horizon"] = 600
    (tmp_path / PLAN).write_text(json.dumps(document))
    with pytest.raises(LedgerError, match="horizon: 600 in the plan, 60 asked for"):
        Ledger(tmp_path, plan())
    (tmp_path / LEDGER).touch()
    with pytest.raises(RecordError, match="was altered"):
        read_study(tmp_path)


def test_a_torn_line_is_cut_and_a_damaged_one_is_named(tmp_path):
    with Ledger(tmp_path, plan()) as ledger:
        finish(ledger)
        with (tmp_path / LEDGER).open("ab") as file:
            file.write(b'{"row": "beg')
        ledger.note("after the kill")
        assert len(ledger.attempts) == 1
    lines = (tmp_path / LEDGER).read_text().splitlines()
    assert [json.loads(line)["row"] for line in lines] == ["begun", "ended", "event"]
    (tmp_path / LEDGER).write_text("\n".join([lines[0], "{", lines[2]]) + "\n")
    with pytest.raises(RecordError, match="line 2 is damaged"):
        read_study(tmp_path)


def test_two_processes_cannot_run_the_same_trials(tmp_path):
    with Ledger(tmp_path, plan()), pytest.raises(LedgerError, match="another process"):
        Ledger(tmp_path, plan()).__enter__()
