"""The adapters against the simulator: layout, axes, experts, and what greedy motion achieves."""

import numpy as np
import pytest

from hcpg import registry
from hcpg.tasks import metaworld as layout
from hcpg.tasks.metaworld import peg_insert_side

SIX = ("button-press", "drawer-open", "door-open", "sweep-into", "peg-insert-side", "lever-pull")
EXPERTS = {
    "button-press": "SawyerButtonPressV3Policy",
    "drawer-open": "SawyerDrawerOpenV3Policy",
    "door-open": "SawyerDoorOpenV3Policy",
    "sweep-into": "SawyerSweepIntoV3Policy",
    "peg-insert-side": "SawyerPegInsertionSideV3Policy",
    "lever-pull": "SawyerLeverPullV3Policy",
}
UNTURNED = {
    "button-press": [1, 0, 0, 0],
    "drawer-open": [1, 0, 0, 0],
    "sweep-into": [0, 0, 0, 1],
    "peg-insert-side": [0, 0, 0, 1],
}
SUITE = "metaworld"
# The package's own experts ask for more than the actions' range, and say so.
pytestmark = pytest.mark.filterwarnings("ignore:Constant.* may be too high")


def active(scene):
    """The direction that counts now."""
    return scene.task if scene.contact > 0.5 else scene.approach


@pytest.mark.parametrize("name", SIX)
def test_the_layout_is_what_the_simulator_observes(make, name):
    environment = make(name)
    first = environment.reset(0)
    simulation = environment._simulation
    assert layout.tip(first) == pytest.approx(simulation.tcp_center, abs=2e-3)
    assert first[layout.GOAL] == pytest.approx(simulation._target_pos, abs=1e-6)
    assert np.array_equal(first[layout.PREVIOUS], first[:18])
    upright = UNTURNED.get(name)
    assert upright is None or first[layout.QUATERNION] == pytest.approx(upright, abs=2e-3)
    assert not first[layout.SECOND_OBJECT].any()
    assert not first[layout.SECOND_QUATERNION].any()
    second = environment.step(np.array([1, 0, 0, 1], np.float32)).observation
    assert np.array_equal(second[layout.PREVIOUS], first[:18])


def test_a_positive_fourth_entry_closes_the_fingers(make):
    environment = make("drawer-open")
    opening = {}
    for effort in (1, -1):
        environment.reset(0)
        for _ in range(30):
            observation = environment.step(np.array([0, 0, 0, effort], np.float32)).observation
        opening[effort] = observation[layout.OPENING]
    assert 0.25 < opening[1] < 0.32
    assert opening[-1] > 0.9


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("sign", [1, -1])
def test_an_action_moves_the_hand_along_its_axis(make, axis, sign):
    environment = make("drawer-open")
    start = environment.reset(0)[layout.HAND]
    action = np.zeros(4, np.float32)
    action[axis] = sign
    for _ in range(8):
        observation = environment.step(action).observation
    shift = observation[layout.HAND] - start
    assert sign * shift[axis] > 0.02
    assert np.abs(np.delete(shift, axis)).max() < 0.3 * abs(shift[axis])


@pytest.mark.parametrize("name", SIX)
@pytest.mark.parametrize("family", ["paper", "contact"])
def test_following_the_approach_shortens_it_to_first_order(make, name, family):
    environment = make(name)
    read = registry.task(f"metaworld/{name}").adapters[family]
    observation = environment.reset(1)
    before = read(observation)
    distance = np.linalg.norm(before.approach)
    toward = before.approach / distance
    for _ in range(5):
        observation = environment.step(np.append(toward, -1.0).astype(np.float32)).observation
    shift = read(observation).tool - before.tool
    # The object may settle by itself, so the distance is to where it was.
    closer = distance - np.linalg.norm(before.approach - shift)
    assert closer > 0.008
    # To first order, the distance shrinks by the motion along the direction.
    assert closer == pytest.approx(np.dot(shift, toward), rel=0.15)


def test_the_pegs_head_is_where_the_simulator_has_it(make):
    environment = make("peg-insert-side")
    for start in (0, 1):
        observation = environment.reset(start)
        head = environment._simulation.data.site("pegHead").xpos
        assert peg_insert_side.peg_head(observation) == pytest.approx(head, abs=2e-3)


@pytest.mark.parametrize("name", SIX)
def test_the_packages_experts_move_along_the_contact_direction(make, name):
    from metaworld import policies

    expert, environment = getattr(policies, EXPERTS[name])(), make(name)
    read, cosines = registry.task(f"metaworld/{name}").adapters["contact"], []
    for start in (0, 1):
        observation = environment.reset(start)
        for _ in range(200):
            action = np.clip(expert.get_action(observation.astype(np.float64)), -1, 1).astype(np.float32)
            vector = active(read(observation))
            lengths = np.linalg.norm(vector) * np.linalg.norm(action[:3])
            cosines.append(np.dot(action[:3], vector) / max(lengths, 1e-9))
            observation, _, _, success = environment.step(action)
            if success:
                break
    assert np.mean(cosines) > 0.1


@pytest.mark.parametrize("name", SIX)
def test_followed_greedily_the_contact_reading_solves_its_task(make, controls, name):
    task = registry.task(f"metaworld/{name}")
    act = controls.follow(name, task, task.adapters["contact"])
    outcome = controls.measure(make(name), act, episodes=2, steps=250)
    assert outcome.success == 1.0
    assert outcome.steps < 130


def test_a_drawer_fools_the_papers_reading_and_random_proposals(make, controls):
    task = registry.task("metaworld/drawer-open")
    greedy = controls.follow("drawer-open", task, task.adapters["paper"])
    assert controls.measure(make("drawer-open"), greedy, episodes=2, steps=250).success == 0.0
    noise = controls.blend_noise(task.adapters["paper"], seed=0)
    assert controls.measure(make("drawer-open"), noise, episodes=2, steps=250).success == 0.0
    guided = controls.blend_noise(task.adapters["contact"], seed=0)
    assert controls.measure(make("drawer-open"), guided, episodes=2, steps=250).success == 1.0


@pytest.mark.parametrize("name", ["pick-place", "window-open"])
def test_followed_greedily_the_generic_reading_solves_its_task(make, controls, name):
    task = registry.task(f"metaworld/{name}")
    act = controls.follow(name, task, task.adapters["contact"])
    assert controls.measure(make(name), act, episodes=2, steps=250).success == 1.0
