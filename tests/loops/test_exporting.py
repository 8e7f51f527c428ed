"""What is exported acts without JAX as it acted with it."""

import json
import shutil
from dataclasses import replace

import jax
import numpy as np
import pytest
from exported_runs import SPEC, TASK, a_run
from jax import numpy as jnp

from hcpg.loops import checkpoints
from hcpg.loops.control.deployed import Policy, PolicyFolderError
from hcpg.loops.exporting import ExportError, export
from hcpg.loops.runs import RunFolder
from hcpg.loops.runs_axis import take
from hcpg.networks.flow import Noise
from hcpg.selection import Selector

# Kind of network, method, settings, draws per coordinate of an action.
CASES = {
    "gated": ("gated", "sac_flow", {"actor_hidden_size": 32}, 5),
    "decoder": (
        "decoder",
        "sac_flow",
        {"velocity": "decoder", "decoder_hidden_size": 16, "flow_steps": 3},
        4,
    ),
    "plain": ("plain", "sac_flow", {"velocity": "plain", "actor_hidden_size": 32}, 5),
    "plain_per_step": (
        "plain",
        "sac_flow",
        {"velocity": "plain", "actor_hidden_size": 32, "plain_norm": "per_step"},
        5,
    ),
    "gaussian": ("gaussian", "sac", {"actor_hidden_size": 32}, 1),
}


@pytest.fixture(scope="module", params=CASES)
def case(request, tmp_path_factory):
    """The case, the run, and its policy as a robot's computer has it."""
    kind, method, learner, draws = CASES[request.param]
    root = tmp_path_factory.mktemp(request.param)
    critic = {} if method == "sac" else {"critic_hidden_size": 8}
    trained = a_run(root / "runs", method, **learner, **critic)
    return kind, draws, trained, export(trained, root / "policy").policy


def of_jax(trained, observation, key, count):
    return np.asarray(trained.method.propose(take(trained.states, 0), jnp.asarray(observation), key, count))


def noise_of_jax(trained, key, count):
    """The noise that `propose` draws from `key`."""
    sizes = (count, SPEC.action_size)
    if trained.settings.method == "sac":
        return np.asarray(jax.random.normal(key, sizes))[None]
    noise = Noise.draw(key, sizes, trained.settings.learner.flow_steps)
    return np.concatenate([noise.start[None], noise.steps])


def test_the_same_noise_leads_to_the_same_actions(case):
    kind, draws, trained, policy = case
    assert policy.facts["network"]["kind"] == kind
    random = np.random.default_rng(11)
    for seed, scale in enumerate((0.1, 1.0)):
        observation = (scale * random.normal(size=SPEC.observation_size)).astype(np.float32)
        key = jax.random.key(seed)
        noise = noise_of_jax(trained, key, 6)
        assert noise.shape == (draws, 6, 4)
        expected = of_jax(trained, observation, key, 6)
        assert expected.std(axis=0).max() > 0.1  # the actions do differ
        np.testing.assert_allclose(policy.actions(observation, noise), expected, rtol=0, atol=1e-5)


def test_proposals_are_float32_within_bounds_and_repeat_with_their_generator(case):
    *_, policy = case
    observation = np.linspace(-1, 1, 11)
    one, same, other = (policy.propose(observation, 5, np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert (one.shape, one.dtype) == ((5, 4), np.float32)
    assert np.abs(one).max() <= 1.0
    np.testing.assert_array_equal(one, same)
    assert np.abs(one - other).max() > 0.01


def test_a_gaussian_alone_acts_by_its_mean(tmp_path):
    alone = Selector("first", candidates=1)
    trained = a_run(tmp_path / "runs", "sac", alone, actor_hidden_size=16, critic_hidden_size=8)
    policy = export(trained, None).policy
    observation = np.linspace(-0.5, 0.5, 11, dtype=np.float32)
    mean = np.asarray(
        trained.method.act(take(trained.states, 0), jnp.asarray(observation), jax.random.key(0))
    )
    for seed in (0, 1):
        np.testing.assert_allclose(policy.act(observation, np.random.default_rng(seed)), mean, atol=1e-5)
    assert (trained.folder.path / "exports/step_000000480_bare_paper/policy.json").is_file()


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    return a_run(tmp_path_factory.mktemp("small"), actor_hidden_size=8, critic_hidden_size=8)


def test_the_facts_and_the_card_say_where_it_comes_from(small, tmp_path):
    exported = export(small, tmp_path / "policy")
    facts = json.loads((exported.folder / "policy.json").read_text())
    assert facts["origin"] | {"run": ""} == {
        "run": "", "method": "sac_flow", "preset": "tested", "budget": "cpu", "budget_steps": 60_000,
        "seed": 5, "step": 480, "adapter_of_run": "paper", "hcpg_version": "0.1.0",
    }  # fmt: skip
    card = (exported.folder / "README.md").read_text()
    assert f"| task | `{TASK}` |" in card
    assert "| adapter | `paper` |" in card
    assert "| preset | `tested` (method `sac_flow`, network `gated`) |" in card
    assert "| budget | `cpu`, 60,000 environment steps |" in card
    # Wilson's interval of 3 in 4, from the formula: (p + z²/2n ± z sqrt(p(1-p)/n + z²/4n²)) / (1 + z²/n).
    assert "| `hcpg` | 480 | 3 of 4 | 75.0 % [30.1, 95.4] |" in card
    assert "Limits of use" in card


def test_an_older_checkpoint_has_the_evaluation_before_it(small, tmp_path):
    # The numbers of the checkpoint do not matter here, only which evaluation counts.
    (small.folder.checkpoints / "step_000000480").rename(small.folder.checkpoints / "step_000000300")
    try:
        exported = export(small._replace(step=300), tmp_path / "policy")
    finally:
        (small.folder.checkpoints / "step_000000300").rename(small.folder.checkpoints / "step_000000480")
    assert [(each["step"], each["successes"]) for each in exported.policy.facts["evaluations"]] == [(240, 1)]


def test_a_run_of_an_arm_keeps_no_observations_and_is_exported_all_the_same(small, tmp_path):
    """Neither does a clone: the probe is then the task's first observation."""
    [whole] = small.folder.checkpoints.glob("step_*")
    _, facts = checkpoints.load(whole, {})
    own = RunFolder(tmp_path / "run")
    shutil.copytree(small.folder.path, own.path, ignore=shutil.ignore_patterns("checkpoints", "exports"))
    checkpoints.save(own.checkpoints, small.step, {"state": take(small.states, 0)}, facts)
    (own.path / "episodes.jsonl").unlink()
    exported = export(small._replace(folder=own), tmp_path / "policy")
    assert exported.policy.facts["evaluations"] == []
    card = (exported.folder / "README.md").read_text()
    assert "None was made up to this step" in card


def test_nothing_is_written_over(small, tmp_path):
    (tmp_path / "policy").mkdir()
    with pytest.raises(PolicyFolderError, match="exists; remove it, or name another place with --out"):
        export(small, tmp_path / "policy")


def test_bare_means_no_selector(small, tmp_path):
    policy = export(small._replace(name="bare"), tmp_path / "policy").policy
    assert policy.selector == Selector("first", candidates=1)


def test_a_selector_that_needs_a_critic_is_refused(small, tmp_path):
    by_value = replace(small.settings, evaluation_selector=Selector("value"))
    with pytest.raises(ExportError, match=r"ranks by a critic, .* --selector hcpg"):
        export(small._replace(settings=by_value, name="value"), tmp_path / "policy")


def test_a_diverged_actor_is_refused(small, tmp_path):
    actor = jax.tree.map(lambda leaf: leaf * jnp.nan, small.states.actor)
    with pytest.raises(ExportError, match="diverged"):
        export(small._replace(states=small.states._replace(actor=actor)), tmp_path / "policy")


def test_an_actor_that_numpy_does_not_know_is_refused(tmp_path):
    trained = a_run(tmp_path, "qsm", actor_hidden_size=8, critic_hidden_size=8)
    with pytest.raises(ExportError, match=r"'qsm' \(Denoiser\) cannot be exported; those of SAC-Flow"):
        export(trained, tmp_path / "policy")


def test_a_loaded_policy_is_the_exported_one(small, tmp_path):
    exported = export(small, tmp_path / "policy")
    again = Policy.load(exported.folder, exported.policy.digest)
    assert again.deviation == exported.policy.deviation < 1e-5
