import numpy as np
import pytest
from point_rig import TASK, constant, uniform

from hcpg.loops.control.choosing import Chooser, UnservedSelectorError
from hcpg.selection import Selector, select

READ = TASK.adapters["paper"]
OBSERVATION = np.array([0, 0, 0.2, 1, 0.1, 0, 0.02, 0, 0, 0.2, 0], np.float32)


def chooser(propose=uniform, **settings):
    return Chooser(propose, Selector(**settings), READ, 4, 0)


def test_the_choice_is_the_selectors_and_keeps_the_proposals():
    choice = chooser().choose(OBSERVATION, 7, alone=False)
    proposals = uniform(None, 4, 7)
    action, seen = select(proposals, READ(OBSERVATION), Selector())
    assert choice.proposals.tolist() == proposals.tolist()
    assert choice.action.tolist() == action.tolist()
    assert choice.weights.tolist() == seen.weights.tolist()
    assert choice.scores.tolist() == seen.scores.tolist()
    assert (choice.phase, choice.unfit) == (float(seen.phase), "")
    assert choice.spread == float(seen.spread)


def test_alone_asks_for_one_proposal_and_takes_it():
    choice = chooser(constant(2.0, -0.5, 0.0, 0.0)).choose(OBSERVATION, 0, alone=True)
    assert choice.proposals.tolist() == [[2.0, -0.5, 0.0, 0.0]]
    assert choice.action.tolist() == [1.0, -0.5, 0.0, 0.0]
    assert np.isnan(choice.scores).all()


def test_lots_depend_on_the_draw_alone():
    drawing = chooser(rule="random")
    first = [drawing.choose(OBSERVATION, draw, alone=False).action.tolist() for draw in (1, 2, 1)]
    assert first[0] == first[2] != first[1]


@pytest.mark.parametrize(
    ("proposals", "reason"),
    [
        (np.full((4, 4), np.nan), "not finite"),
        (np.full((4, 4), np.inf), "not finite"),
        (np.zeros((4, 3)), "shape (4, 3), not (4, 4)"),
        (np.zeros((3, 4)), "shape (3, 4), not (4, 4)"),
        (np.zeros((4, 4), int), "type int64"),
    ],
)
def test_unfit_proposals_give_a_reason_and_no_action(proposals, reason):
    choice = chooser(lambda *_: proposals).choose(OBSERVATION, 0, alone=False)
    assert reason in choice.unfit
    assert choice.action.tolist() == [0, 0, 0, 0]
    assert choice.proposals is proposals


def test_a_selector_that_needs_a_critic_is_refused():
    with pytest.raises(UnservedSelectorError, match="'value' needs a critic"):
        chooser(rule="value")
