"""What Meta-World's adapters read: by hand, in the simulator, and the same from every array library."""

from pathlib import Path

import array_api_compat.torch as xp_torch
import jax
import numpy as np
import pytest

from hcpg import registry
from hcpg.tasks.metaworld import button_press, drawer_open, lever_pull, peg_insert_side, sweep_into
from hcpg.tasks.metaworld.generic import FAMILY, REFUSED

SIX = ("button-press", "drawer-open", "door-open", "sweep-into", "peg-insert-side", "lever-pull")
ONE_PER_READING = (
    "button-press-topdown",
    "coffee-button",
    "button-press-wall",
    "pick-place",
    "shelf-place",
    "reach",
)
# The object's quaternion where it lies untilted at the start; the scalar's place differs between tasks.
ROOT = Path(__file__).parents[2]


def observation_of(hand, item, goal, opening=1.0, quaternion=(0.0, 0.0, 0.0, 1.0)):
    observation = np.zeros(39)
    observation[0:3], observation[3], observation[4:7] = hand, opening, item
    observation[7:11], observation[36:39] = quaternion, goal
    return observation


def near(*numbers):
    return pytest.approx(numbers, abs=1e-9)


# --- every task ------------------------------------------------------------------------------------------


def test_all_fifty_tasks_are_read_or_refused():
    from metaworld import MT1

    assert {*SIX, *FAMILY, *REFUSED} == {name.removesuffix("-v3") for name in MT1.ENV_NAMES}
    assert len(SIX) + len(FAMILY) + len(REFUSED) == 50
    for name in (*SIX, *FAMILY):
        task = registry.task(f"metaworld/{name}")
        assert (task.suite, task.env_id, task.horizon) == ("metaworld", f"{name}-v3", 500)
        assert list(task.adapters) == ["paper", "contact"]


@pytest.mark.parametrize("name", REFUSED)
def test_a_refusal_says_why(name):
    with pytest.raises(registry.RefusedTaskError) as refusal:
        registry.task(f"metaworld/{name}")
    assert REFUSED[name] in str(refusal.value)
    assert len(REFUSED[name]) > 40


@pytest.mark.parametrize("name", [*SIX, *ONE_PER_READING])
@pytest.mark.parametrize("family", ["paper", "contact"])
def test_every_library_reads_the_same_scene(name, family):
    read = registry.task(f"metaworld/{name}").adapters[family]
    random = np.random.default_rng(0)
    batch = random.uniform(-0.2, 0.2, (64, 39)).astype(np.float32)
    batch[:, 3] = random.uniform(0, 1, 64)
    # Half of the objects lie at a part of the hand that touches, so that contact occurs.
    part = [0.0, 0.055, 0.07] if name == "lever-pull" else [0.0, 0.0, -0.03]
    batch[32:, 4:7] = batch[32:, 0:3] + random.uniform(-0.02, 0.02, (32, 3)) + part
    scene = read(batch)
    for other in (
        jax.jit(read)(batch),
        jax.vmap(read)(batch),
        read(xp_torch.asarray(batch)),
        read(batch.reshape(8, 8, 39)),
    ):
        for numpys, theirs in zip(scene, other, strict=True):
            if numpys is None:
                assert theirs is None
                continue
            assert numpys.dtype == np.float32
            assert np.asarray(theirs).reshape(numpys.shape) == pytest.approx(numpys, abs=1e-6)
    if scene.contact is not None and "reach" not in name:
        assert 5 < scene.contact.sum() < 40


def test_the_paper_reads_hand_object_and_goal():
    observation = np.arange(39.0)
    for name in (*SIX, "pick-place"):
        scene = registry.task(f"metaworld/{name}").adapters["paper"](observation)
        assert scene.contact is None
        assert scene.tool == near(0, 1, 2)
        assert scene.object == near(4, 5, 6)
        assert scene.goal == near(36, 37, 38)
        assert scene.approach == near(4, 4, 4)
        assert scene.task == near(32, 32, 32)


# --- by hand ---------------------------------------------------------------------------------------------


def test_button_contact_is_eight_centimetres_from_the_fingertips():
    at = [0.0, 0.6, 0.145]
    far = button_press.read_contact_scene(observation_of(at, [0, 0.69, 0.1], [0, 0.78, 0.1]))
    close = button_press.read_contact_scene(observation_of(at, [0, 0.67, 0.1], [0, 0.78, 0.1]))
    assert far.approach == near(0, 0.09, 0)
    assert close.task == near(0, 0.11, 0)
    assert (far.contact, close.contact) == (0, 1)


def test_drawer_hand_comes_down_through_a_funnel():
    handle, goal = [0.0, 0.7, 0.09], [0.0, 0.5, 0.09]
    outside = drawer_open.read_contact_scene(observation_of([0, 0.6, 0.2], handle, goal))
    inside = drawer_open.read_contact_scene(observation_of([0, 0.66, 0.2], handle, goal))
    touching = drawer_open.read_contact_scene(observation_of([0, 0.66, 0.1], handle, goal))
    assert outside.approach == near(0, 0.1, 0.15)  # 0.09 - 0.02 + 0.28 - 0.2
    assert inside.approach == near(0, 0.04, -0.13)
    assert touching.task == near(0, -0.2, 0)
    assert [scene.contact for scene in (outside, inside, touching)] == [0, 0, 1]


def test_door_hand_hooks_beside_and_behind_the_handle():
    read = registry.task("metaworld/door-open").adapters["contact"]
    handle, goal = [0.2, 0.7, 0.15], [-0.1, 0.4, 0.15]
    outside = read(observation_of([0.11, 0.72, 0.15], handle, goal))
    touching = read(observation_of([0.21, 0.72, 0.19], handle, goal))
    assert outside.approach == near(0.1, 0, 0.1)
    assert touching.approach == near(0, 0, -0.04)
    assert touching.task == near(-0.3, -0.3, 0)
    assert (outside.contact, touching.contact) == (0, 1)


def test_sweep_leaves_out_the_height_of_the_goal():
    scene = sweep_into.read_contact_scene(observation_of([0, 0.6, 0.11], [0, 0.6, 0.07], [0.1, 0.84, 0.02]))
    assert scene.approach == near(0, 0, 0.005)
    assert scene.task == near(0.1, 0.24, 0)
    assert scene.contact == 1


def test_peg_head_stands_off_until_it_is_aligned_and_contact_takes_closed_fingers():
    goal, peg = [-0.3, 0.6, 0.13], [0.0, 0.5, 0.14]
    hand = [0.0, 0.5, 0.185]
    astray = peg_insert_side.read_contact_scene(observation_of(hand, peg, goal, opening=0.3))
    # The head lies 13 cm to the left of the grasp and 1 cm below it.
    assert astray.object == near(-0.13, 0.5, 0.13)
    assert astray.task == near(-0.07, 0.1, 0)
    aligned = peg_insert_side.read_contact_scene(
        observation_of([0, 0.59, 0.185], [0, 0.59, 0.14], goal, opening=0.3)
    )
    assert aligned.task == near(-0.17, 0.01, 0)
    still_open = peg_insert_side.read_contact_scene(observation_of(hand, peg, goal, opening=0.9))
    assert (astray.contact, aligned.contact, still_open.contact) == (1, 1, 0)


def test_lever_follows_its_arc_and_is_taken_from_below():
    goal = [0.0, 0.7, 0.45]
    # The pivot is at (0, 0.7, 0.25); a lever that points at the robot turns upwards.
    assert lever_pull.lever_tangent(np.array([0, 0.5, 0.25]), np.array(goal)) == near(0, 0, 0.2)
    assert lever_pull.lever_tangent(np.array([0, 0.7, 0.45]), np.array(goal)) == near(0, 0.2, 0)
    far = lever_pull.read_contact_scene(observation_of([0, 0.4, 0.1], [0, 0.5, 0.25], goal))
    assert far.approach == near(0, 0.045, -0.02)  # shoulder (0, 0.455, 0.17), aim (0, 0.5, 0.15)
    under = lever_pull.read_contact_scene(observation_of([0, 0.445, 0.13], [0, 0.5, 0.25], goal))
    assert under.approach == near(0, 0, 0.05)
    assert (far.contact, under.contact) == (0, 1)


def test_one_of_each_generic_reading_is_tested():
    readings = {task.adapters["contact"] for task in FAMILY.values()}
    assert {FAMILY[name].adapters["contact"] for name in ONE_PER_READING} == readings


def test_a_generic_reading_lifts_grasps_and_funnels():
    read = FAMILY["shelf-place"].adapters["contact"]
    item, goal = [0.0, 0.6, 0.02], [0.0, 0.85, 0.3]
    above = read(observation_of([0.03, 0.6, 0.265], item, goal))
    assert above.approach == near(-0.03, 0, -0.1)
    held = read(observation_of([0, 0.6, 0.065], item, goal, opening=0.5))
    assert held.task == near(0, 0.25, 0.43)
    nearly = read(observation_of([0, 0.83, 0.365], [0, 0.83, 0.32], goal, opening=0.5))
    assert nearly.task == near(0, 0.02, -0.02)
    still_open = read(observation_of([0, 0.6, 0.065], item, goal))
    assert [scene.contact for scene in (above, held, nearly, still_open)] == [0, 1, 1, 0]


def test_reach_has_no_object_and_is_always_in_contact():
    observation = observation_of([0, 0.6, 0.2], [9, 9, 9], [0.1, 0.8, 0.2])
    for name in ("reach", "reach-wall"):
        paper, contact = (FAMILY[name].adapters[family](observation) for family in ("paper", "contact"))
        for direction in (paper.approach, paper.task):
            assert direction == near(0.1, 0.2, 0)
        for direction in (contact.approach, contact.task):
            assert direction == near(0.1, 0.2, 0.045)
        assert (paper.contact, contact.contact) == (None, 1)


# --- in the simulator ------------------------------------------------------------------------------------
