"""What is true of a scene: travels, depths and openings set by hand, and what counts as done."""

import numpy as np
import pytest

from hcpg.twin.judging import Judge
from hcpg.twin.physics import Physics
from hcpg.twin.scenes import SCENES, layout

mujoco = pytest.importorskip("mujoco")


def judged(task):
    physics = Physics(SCENES[task])
    physics.lay_out(layout(SCENES[task], 0, 0))
    return physics, Judge(task, physics.model, physics.data)


def set_joint(physics, name, value):
    physics.data.joint(name).qpos[0] = value
    physics.refresh()


def test_a_button_is_pressed_from_10_mm_of_travel():
    physics, judge = judged("button-press")
    assert judge.tick().reach_m == pytest.approx(np.linalg.norm(judge.look().object - judge.look().tip))
    set_joint(physics, "button", 0.0095)
    assert judge.tick().progress == pytest.approx(0.95)
    assert not judge.look().done
    set_joint(physics, "button", 0.0100)
    assert judge.tick().done
    set_joint(physics, "button", 0.0080)
    up = judge.tick()
    assert (up.done, up.was_done) == (False, True)
    judge.restart()
    assert not judge.tick().was_done


def test_a_drawer_is_closed_below_8_mm_and_progress_counts_from_where_it_was():
    physics, judge = judged("drawer-closing")
    opening = float(physics.data.joint("drawer").qpos[0])
    assert 0.10 <= opening <= 0.15
    assert judge.tick().progress == 0.0
    set_joint(physics, "drawer", opening / 4)
    assert judge.tick().progress == pytest.approx(0.75)
    set_joint(physics, "drawer", 0.0079)
    assert judge.tick().done
    goal, handle = judge.look().goal, judge.look().object
    np.testing.assert_allclose(goal - handle, [0.0079, 0.0, 0.0], atol=1e-9)


def test_a_peg_counts_only_inside_the_hole_and_after_three_ticks():
    physics, judge = judged("peg-insertion")
    mouth = judge.look().object

    def put_tip(position):
        """Move the fixture instead of the arm: what counts is where they are to each other."""
        fixture = physics.model.body("fixture").id
        physics.model.body_pos[fixture] += judge.look().tip - position
        physics.refresh()
        return judge.look()

    deep = put_tip(mouth - [0.003, 0.0, 0.025 + 1e-6])
    assert (deep.progress, deep.holds, deep.done) == (1.0, True, False)
    assert [judge.tick().done for _ in range(3)] == [False, False, True]
    shallow = put_tip(judge.look().object - [0.0, 0.0, 0.010])
    assert shallow.progress == pytest.approx(0.4)
    beside = put_tip(judge.look().object - [0.010, 0.0, 0.030])
    assert (beside.progress, beside.holds) == (0.0, False)
    assert not judge.tick().done


def test_a_ball_has_to_be_gripped_lifted_and_held():
    physics, judge = judged("rugby-grasp")
    ball = physics.data.joint("ball")
    ball.qpos[2] += 0.06
    physics.refresh()
    lifted = judge.tick()
    assert (lifted.progress, lifted.holds) == (0.0, False)
    np.testing.assert_allclose(lifted.goal, judge.first + np.array([0.0, 0.0, 0.10]))


def test_the_table_holds_the_ball_up_and_no_gravity_pulls_at_the_arm():
    physics, judge = judged("rugby-grasp")
    start = physics.position
    for _ in range(240):
        physics.step()
    assert judge.look().object[2] == pytest.approx(0.032, abs=5e-4)
    assert np.linalg.norm(physics.position - start) < 5e-4
