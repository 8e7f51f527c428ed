"""The batched interface on the processor, whose batches are of one: the same calls as on a GPU."""

import jax
import numpy as np
import pytest
import torch

from hcpg import registry
from hcpg.interfaces import BatchedSuite
from hcpg.suites.maniskill import SUITE, ManiskillSuite, batch, building
from hcpg.tasks.maniskill import pick_cube

pytestmark = pytest.mark.filterwarnings("ignore:__array_wrap__")  # ManiSkill asks NumPy about a tensor
PROCESSOR = ManiskillSuite(batch_backend="physx_cpu")
PICK = registry.task("maniskill/pick-cube")


@pytest.fixture(scope="module")
def pair():
    """PickCube twice, as a batch of one and as training on a processor has it, with seed 3's start states."""
    both = PROCESSOR.make_batch(PICK, [3]), SUITE.make(PICK, 3)
    yield both
    for each in both:
        each.close()


def grasp(observation):
    scene = pick_cube.read_scene(observation)
    vector = scene.task if scene.contact > 0.5 else scene.approach
    closes = scene.contact > 0.5 or np.linalg.norm(scene.approach) < 0.015
    return np.append(np.clip(vector / 0.1, -1, 1), -1.0 if closes else 1.0).astype(np.float32)


def test_a_batch_steps_like_the_environment_it_stands_for(pair):
    many, one = pair
    for start in (5, 4096 + 5, 9):
        first, observation = many.reset(np.array([start])), one.reset(start)
        assert np.array_equal(first[0], observation)
        for _ in range(25):
            action = grasp(observation)
            observations, rewards, successes = many.step(action[None])
            observation, reward, _, success = one.step(action)
            assert np.asarray(observations)[0] == pytest.approx(observation, abs=2e-2)
            assert float(rewards[0]) == pytest.approx(reward, abs=1e-2)
            assert bool(successes[0]) == success
        assert observation[pick_cube.IS_GRASPED] == np.asarray(observations)[0, pick_cube.IS_GRASPED] == 1.0
    assert many.reset(np.array([1]))[0, pick_cube.IS_GRASPED] == 0.0


def test_answers_are_jaxs_over_pytorchs_memory(pair, monkeypatch):
    many, _ = pair
    tensors = []
    stock = many._simulation.step

    def step(actions):
        answer = stock(actions)
        tensors.append((answer[0], answer[1]))
        return answer

    monkeypatch.setattr(many._simulation, "step", step)
    many.reset(np.array([0]))
    observations, rewards, successes = many.step(np.zeros((1, 4), np.float32))
    kinds = [
        (type(each).__name__, str(each.dtype), each.shape) for each in (observations, rewards, successes)
    ]
    assert [kind[1:] for kind in kinds] == [("float32", (1, 42)), ("float32", (1,)), ("bool", (1,))]
    assert all(isinstance(each, jax.Array) for each in (observations, rewards, successes))
    assert np.array_equal(observations, tensors[0][0].numpy())
    # JAX takes over memory that begins at a multiple of 64 bytes, as a GPU's always does; else it copies.
    if tensors[0][0].data_ptr() % 64 == 0:
        assert observations.unsafe_buffer_pointer() == tensors[0][0].data_ptr()


def test_a_start_state_is_drawn_once(pair, monkeypatch):
    many, _ = pair
    drawn = []
    stock = many._drawer.reset
    monkeypatch.setattr(many._drawer, "reset", lambda seed: drawn.append(seed) or stock(seed=seed))
    firsts = [np.asarray(many.reset(np.array([start]))) for start in (40, 41, 40)]
    assert drawn == [3 * 4096 + 40, 3 * 4096 + 41]
    assert np.array_equal(firsts[0], firsts[2])
    assert not np.array_equal(firsts[0], firsts[1])


def test_states_of_many_are_stacked_in_order():
    one = {"actors": {"cube": torch.zeros(1, 13)}, "articulations": {"panda": torch.zeros(1, 31)}}
    other = {"actors": {"cube": torch.ones(1, 13)}, "articulations": {"panda": torch.ones(1, 31)}}
    stacked = batch._stacked([one | {"controller": {}}, other, other])
    assert stacked["actors"]["cube"][:, 0].tolist() == [0, 1, 1]
    assert stacked["articulations"]["panda"].shape == (3, 31)
    assert set(stacked) == {"actors", "articulations"}


def test_on_a_gpu_hundreds_are_built_and_pytorch_gets_its_share(monkeypatch):
    built, shares = [], []

    class Stub:
        def close(self):
            built.append("closed")

    monkeypatch.setattr(batch, "build_simulation", lambda *address: built.append(address) or Stub())
    monkeypatch.setattr(batch, "build_batch", lambda *address: built.append(address) or Stub())
    monkeypatch.setattr(torch.cuda, "set_per_process_memory_fraction", shares.append)
    many = SUITE.make_batch(registry.task("maniskill/poke-cube"), [2] * 256)
    assert built == [
        ("PokeCube-v1", "pd_ee_delta_pose"),
        ("PokeCube-v1", "pd_ee_delta_pose", "physx_cuda", 256),
    ]
    assert shares == [0.1]
    assert many._first_seeds.tolist() == [2 * 4096] * 256
    many.close()
    assert built[2:] == ["closed", "closed"]


def test_the_processor_takes_a_batch_of_one_alone():
    assert isinstance(SUITE, BatchedSuite)
    with pytest.raises(RuntimeError, match="multiple environments"):
        building.build_batch("PushCube-v1", "pd_ee_delta_pos", "physx_cpu", 2)
    with pytest.raises(ValueError, match="got -1"):
        PROCESSOR.make_batch(PICK, [0, -1])
