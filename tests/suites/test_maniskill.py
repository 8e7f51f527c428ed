"""ManiSkill as a suite: its traps, its determinism, its control modes."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from hcpg import registry
from hcpg.interfaces import Task
from hcpg.suites import maniskill as suite
from hcpg.tasks.maniskill import CLOSE, FINGERS, OPEN, POSE, pick_cube, push_cube
from hcpg.types import Spec

NAMES = ("push-cube", "pull-cube", "pick-cube", "poke-cube")
TASKS = {name: registry.task(f"maniskill/{name}") for name in NAMES}


@pytest.fixture(scope="module")
def make():
    """Environments by task, each made once."""
    made = {}

    def environment(name):
        if name not in made:
            made[name] = suite.SUITE.make(registry.task(f"maniskill/{name}"), seed=0)
        return made[name]

    yield environment
    for each in made.values():
        each.close()


def still(size=4, gripper=OPEN):
    return np.append(np.zeros(size - 1), gripper).astype(np.float32)


def follow(environment, read_scene, first, steps, closes_within_m=0.0, turns=0):
    """Follow a scene's directions; the fingers close near the object. All answers."""
    observation, answers = first, []
    for _ in range(steps):
        scene = read_scene(observation)
        held = scene.contact > 0.5
        vector = scene.task if held else scene.approach
        distance = np.linalg.norm(vector)
        closes = held or np.linalg.norm(scene.approach) < closes_within_m
        move = vector / max(distance, 1e-6) * min(1.0, 10 * distance)
        action = np.concatenate([move, np.zeros(turns), [CLOSE if closes else OPEN]])
        answers.append(environment.step(action.astype(np.float32)))
        observation = answers[-1].observation
    return answers


def test_sizes_are_known_before_anything_is_built():
    sizes = [suite.SUITE.spec(TASKS[name]) for name in NAMES]
    assert sizes == [Spec(35, 4), Spec(35, 4), Spec(42, 4), Spec(54, 7)]
    assert suite.SUITE.spec(registry.task("maniskill/push-cube-delta-pose")) == Spec(35, 7)
    assert suite.SUITE.spec(registry.task("maniskill/poke-cube-delta-pos")) == Spec(54, 4)


@pytest.mark.parametrize("name", NAMES)
def test_it_is_the_stock_task_with_fifty_steps_at_twenty_a_second(make, name):
    from mani_skill.utils.registration import REGISTERED_ENVS

    environment, task = make(name), TASKS[name]
    stock = environment._stepping.simulation
    assert REGISTERED_ENVS[task.env_id].max_episode_steps == task.horizon == 50
    assert (stock.control_freq, stock.sim_freq, stock.robot_uids) == (20, 100, "panda")
    assert (stock.reward_mode, stock.obs_mode) == ("normalized_dense", "state")
    assert stock.control_mode == task.control.partition(":")[0]
    observation = environment.reset(0)
    assert (observation.shape, observation.dtype) == ((suite.OBSERVATION_SIZES[task.env_id],), np.float32)


def test_start_states_are_numbered_wrap_around_and_are_disjoint_between_seeds(make):
    environment = make("push-cube")
    firsts = np.asarray([environment.reset(start) for start in (0, 1, 4095, 4096, 4097)])
    assert np.array_equal(firsts[:2], firsts[3:])
    assert len(np.unique(firsts[:3], axis=0)) == 3
    environment._seed = 1
    following = environment.reset(0)
    environment._seed = 0
    # ManiSkill's own seeds run on: the first of seed 1 is no start state of seed 0.
    stock, _ = environment._stepping.simulation.reset(seed=4096)
    assert np.array_equal(stock[0].numpy(), following)
    assert not (firsts == following).all(axis=1).any()


def test_the_largest_seed_fits_into_maniskills_thirty_two_bits():
    assert suite.LARGEST_SEED * suite.START_STATES + suite.START_STATES - 1 == 2**32 - 1
    with pytest.raises(ValueError, match=r"\[0, 1048575\], got 1048576"):
        suite.SUITE.make(TASKS["push-cube"], seed=2**20)
    with pytest.raises(ValueError, match="got -1"):
        suite.SUITE.make(TASKS["push-cube"], seed=-1)


def test_an_unseeded_reset_of_the_package_draws_from_pytorchs_generator_and_ours_does_not(make):
    environment = make("push-cube")
    torch.manual_seed(5)
    before = torch.get_rng_state()
    first = environment.reset(3)
    environment.step(still())
    assert torch.equal(torch.get_rng_state(), before)
    torch.manual_seed(6)
    assert np.array_equal(environment.reset(3), first)
    environment._stepping.simulation.reset()
    assert not torch.equal(torch.get_rng_state(), before)


def test_numpys_generator_is_not_moved_either(make):
    np.random.seed(3)  # noqa: NPY002 - the generator under test
    before = np.random.get_state()  # noqa: NPY002 - the generator under test
    make("pick-cube").reset(0)
    after = np.random.get_state()  # noqa: NPY002 - the generator under test
    assert np.array_equal(before[1], after[1])
    assert before[2:] == after[2:]


def test_a_grasp_outlives_the_reset_in_the_package_and_not_here(make):
    environment = make("pick-cube")
    held = follow(environment, pick_cube.read_scene, environment.reset(0), 25, closes_within_m=0.015)
    assert held[-1].observation[pick_cube.IS_GRASPED] == 1.0
    stale, _ = environment._stepping.simulation.reset(seed=1)
    assert float(stale[0, pick_cube.IS_GRASPED]) == 1.0
    assert float(torch.linalg.norm(stale[0, pick_cube.CUBE] - stale[0, pick_cube.TOOL])) > 0.1
    follow(environment, pick_cube.read_scene, environment.reset(0), 25, closes_within_m=0.015)
    first = environment.reset(1)
    assert first[pick_cube.IS_GRASPED] == 0.0
    rest = np.delete(stale[0].numpy(), pick_cube.IS_GRASPED)
    assert np.array_equal(np.delete(first, pick_cube.IS_GRASPED), rest)
    assert environment.step(still()).observation[pick_cube.IS_GRASPED] == 0.0


@pytest.mark.parametrize("name", NAMES)
def test_episodes_repeat_bit_for_bit_whatever_was_touched_before(make, name):
    environment, fresh, seven = make(name), suite.SUITE.make(TASKS[name], seed=0), name == "poke-cube"

    def episode(each, start, steps):
        closes_within_m = 1.0 if name.startswith("pu") else 0.015
        read = TASKS[name].adapters["contact"]
        answers = follow(each, read, each.reset(start), steps, closes_within_m, turns=3 * seven)
        return np.asarray([[*step.observation, step.reward, step.success] for step in answers])

    rows = [episode(environment, 4, 40)]
    for start, steps in ((9, 31), (10, 17)):
        episode(environment, start, steps)
        rows.append(episode(environment, 4, 40))
    assert np.array_equal(rows[0], rows[1])
    assert np.array_equal(rows[0], rows[2])
    assert np.array_equal(rows[0], episode(fresh, 4, 40))
    fresh.close()


def test_a_cube_that_was_hit_stays_awake_no_longer_in_the_next_episode():
    """PhysX keeps a body awake for longer the harder it was hit, and the body takes that along."""

    def push(environment, start, read, within_m, steps):
        observation, rows = environment.reset(start), []
        for _ in range(steps):
            scene = read(observation)
            vector = scene.task if (scene.contact or 0.0) > 0.5 else scene.approach
            action = np.append(np.clip(vector / within_m, -1, 1), CLOSE).astype(np.float32)
            observation = environment.step(action).observation
            rows.append(observation)
        return np.asarray(rows)

    adapters = TASKS["push-cube"].adapters
    used, fresh = (suite.SUITE.make(TASKS["push-cube"], seed=0) for _ in range(2))
    push(used, 112, adapters["paper"], 0.05, 12)
    rows = [push(each, 0, adapters["contact"], 0.1, 30) for each in (used, fresh)]
    assert np.array_equal(*rows)
    for each in (used, fresh):
        each.close()


def test_the_packages_own_reset_leaves_contacts_that_change_the_next_episode(make):
    environment = make("push-cube")
    read, stepping = push_cube.read_contact_scene, environment._stepping
    ends = []
    ours, stock = lambda: environment.reset(4), lambda: stepping.reset(4)
    for reset in (ours, stock, ours):
        ends.append(follow(environment, read, reset(), 30, 1.0)[-1].observation)
    assert np.array_equal(ends[0], ends[2])
    assert np.abs(ends[0] - ends[1]).max() > 1e-3


@pytest.mark.filterwarnings("ignore:__array_wrap__")  # ManiSkill asks NumPy about a tensor
def test_a_success_ends_the_packages_episode_and_not_ours(make):
    environment = make("push-cube")
    answers = follow(environment, push_cube.read_contact_scene, environment.reset(1), 50, closes_within_m=1.0)
    succeeded = [step.success for step in answers]
    assert succeeded.index(True) < 45
    assert not any(step.terminated for step in answers)
    # ManiSkill's own rule for the step: the cube's middle within 0.1 m of the disc's, as seen from above.
    for step in answers:
        cube, goal = step.observation[push_cube.CUBE], step.observation[push_cube.GOAL]
        assert step.success == (np.linalg.norm((cube - goal)[:2]) < 0.1 and cube[2] < 0.025)
        assert (step.reward == 1.0) == step.success
        assert 0.0 <= step.reward <= 1.0
        assert (type(step.reward), type(step.success)) == (float, bool)
    stock = environment._stepping.simulation
    environment.reset(1)
    assert not bool(stock.step(still())[2][0])
    stock.obj.set_pose(stock.goal_region.pose)
    assert bool(stock.step(still())[2][0])


def test_one_opens_and_minus_one_closes_the_fingers(make):
    environment = make("push-cube")
    widths = []
    for gripper in (CLOSE, OPEN, 0.0):
        environment.reset(0)
        for _ in range(10):
            observation = environment.step(still(gripper=gripper)).observation
        widths.append(observation[FINGERS])
    # The two fingers carry 0.04 m each at 1; the command of 0 lies between the limits -0.01 and 0.04.
    assert widths[0] == pytest.approx([0.0, 0.0], abs=2e-3)
    assert widths[1] == pytest.approx([0.04, 0.04], abs=2e-3)
    assert widths[2] == pytest.approx([0.015, 0.015], abs=2e-3)


@pytest.mark.parametrize("axis", range(3))
def test_a_unit_moves_the_hand_along_its_world_axis(make, axis):
    environment, move = make("push-cube"), still()
    before = environment.reset(0)[push_cube.TOOL]
    move[axis] = 0.5
    after = environment.step(move).observation[push_cube.TOOL]
    assert np.argmax(np.abs(after - before)) == axis
    assert 0.005 < (after - before)[axis] < 0.05


def test_the_seven_entries_move_the_hand_as_the_four_do(make):
    four, seven = make("push-cube"), make("push-cube-delta-pose")
    assert np.array_equal(four.reset(2), seven.reset(2))
    moves = np.random.default_rng(0).uniform(-0.5, 0.5, (5, 4)).astype(np.float32)
    for move in moves:
        one = four.step(move).observation
        other = seven.step(np.insert(move, 3, np.zeros(3, np.float32))).observation
    assert one[push_cube.TOOL] == pytest.approx(other[push_cube.TOOL], abs=1e-3)


def test_an_action_beyond_the_box_acts_like_its_edge(make):
    environment, ends = make("push-cube"), []
    for move in ([3.0, -2.0, 0.5, 7.0], [1.0, -1.0, 0.5, 1.0]):
        environment.reset(0)
        ends.append(environment.step(np.asarray(move, np.float32)).observation)
    assert np.array_equal(ends[0], ends[1])


@pytest.mark.parametrize("action", [np.zeros(7, np.float32), np.full(4, np.nan, np.float32)])
def test_an_action_that_is_none_is_refused(make, action):
    with pytest.raises(ValueError, match="4 finite numbers"):
        make("push-cube").step(action)


def test_wrong_addresses_are_named():
    typo = Task("maniskill", "PushCube-v2", 50, POSE, {})
    with pytest.raises(ValueError, match=r"no task 'PushCube-v2' here\. Did you mean 'PushCube-v1'\?"):
        suite.SUITE.make(typo, seed=0)
    with pytest.raises(ValueError, match="no control mode 'pd_joint_pos' here"):
        suite.SUITE.spec(replace(TASKS["push-cube"], control="pd_joint_pos: eight"))


def test_closing_twice_is_closing():
    environment = suite.SUITE.make(TASKS["push-cube"], seed=0)
    environment.close()
    environment.close()
