"""NumPy, JAX (eager, compiled, mapped) and PyTorch give the same numbers."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import torch

from hcpg.selection import RULES, Scene, Selector, select

COUNT, SIZE, SETS = 4, 7, 24


@pytest.fixture
def problem(generator):
    """Proposals, scenes with a flag (half of the tools stand within the gate), lots, values."""
    thing, goal = generator.normal(size=(2, SETS, 3))
    tool = thing + generator.normal(size=(SETS, 3)) * np.where(np.arange(SETS) % 2, 0.02, 0.5)[:, None]
    scene = Scene.of(tool, thing, goal, contact=generator.uniform(size=SETS))
    extras = generator.uniform(size=(2, SETS, COUNT))
    return generator.uniform(-1, 1, (SETS, COUNT, SIZE)), scene, *extras


def every_rule(proposals, scene, noise, values):
    """All rules at once, so that JAX compiles once; and HCPG along the controls' directions."""
    rules = {rule: rule for rule in RULES}
    rules |= {f"hcpg {name}": Selector(direction=name) for name in ("opposed", "random")}
    return {name: select(proposals, scene, rule, noise=noise, values=values) for name, rule in rules.items()}


COMPILED = jax.jit(every_rule)


def agree(call, convert, problem, tolerance):
    expected = every_rule(*problem)
    got = call(*jax.tree.map(convert, problem))
    for rule in expected:
        for wanted, given in zip(jax.tree.leaves(expected[rule]), jax.tree.leaves(got[rule]), strict=True):
            assert np.asarray(given).dtype == wanted.dtype == problem[0].dtype
            np.testing.assert_allclose(given, wanted, rtol=0, atol=tolerance, err_msg=rule)


@pytest.mark.parametrize(("dtype", "tolerance"), [(np.float64, 1e-6), (np.float32, 1e-5)])
class TestAgreement:
    @pytest.fixture
    def typed(self, problem, dtype):
        return jax.tree.map(lambda part: part.astype(dtype), problem)

    def test_pytorch(self, typed, dtype, tolerance):
        agree(every_rule, torch.asarray, typed, tolerance)

    def test_jax_compiled(self, typed, dtype, tolerance):
        with jax.enable_x64(dtype == np.float64):
            agree(jax.jit(every_rule), jnp.asarray, typed, tolerance)

    def test_jax_mapped(self, typed, dtype, tolerance):
        with jax.enable_x64(dtype == np.float64):
            agree(jax.jit(jax.vmap(every_rule)), jnp.asarray, typed, tolerance)


@pytest.mark.parametrize(("call", "convert"), [(select, torch.asarray), (jax.jit(select), jnp.asarray)])
def test_the_gate_agrees(call, convert, problem):
    proposals, scene = jax.tree.map(lambda part: part.astype(np.float32), problem[:2])
    gated = scene._replace(contact=None)
    action, seen = call(convert(proposals), jax.tree.map(convert, gated))
    expected, expected_seen = select(proposals, gated)
    assert expected_seen.phase.tolist() == [0.0, 1.0] * (SETS // 2)
    np.testing.assert_allclose(seen.phase, expected_seen.phase)
    np.testing.assert_allclose(action, expected, atol=1e-5)


def test_jax_eager(flagged_scene):
    proposals = np.array([[0.5, 0.0, 0.0, 1.0], [-0.5, 0.0, 0.0, -1.0]], np.float32)
    action, seen = select(jnp.asarray(proposals), flagged_scene)
    # The same hand-worked numbers as in test_selecting.
    assert seen.weights == pytest.approx([0.9457, 0.0543], abs=5e-5)
    assert action == pytest.approx([0.4457, 0.0, 0.0, 0.8914], abs=1e-4)
    assert isinstance(action, jax.Array)


def test_a_selector_is_a_static_argument_of_a_compiled_function(problem):
    proposals, scene, _, _ = jax.tree.map(jnp.asarray, problem)
    compiled = jax.jit(select, static_argnums=2)
    action, _ = compiled(proposals, scene, Selector(top_k=1))
    best, _ = compiled(proposals, scene, Selector(rule="argmax"))
    np.testing.assert_allclose(action, best, atol=1e-6)


def test_pytorch_proposals_may_carry_gradients():
    proposals = torch.zeros(4, 4, requires_grad=True)
    action, _ = select(proposals, Scene.of(*np.eye(3)), "mean")
    action.sum().backward()
    assert proposals.grad is not None


class TestTraced:
    """While JAX traces, numbers cannot be checked: bad candidates get no weight."""

    SCENE = Scene.of(*jnp.eye(3), contact=jnp.array(0.0))

    @pytest.mark.parametrize("bad", [jnp.nan, jnp.inf, -jnp.inf])
    def test_a_bad_candidate_is_left_out(self, bad, generator):
        proposals = jnp.asarray(generator.uniform(-1, 1, (4, 4)), jnp.float32)
        noise, values = jnp.asarray(generator.uniform(size=(2, 4)), jnp.float32)
        got = COMPILED(proposals.at[0, 3].set(bad), self.SCENE, noise, values)
        left = np.array([1, 2, 3])
        wanted = every_rule(
            *jax.tree.map(np.asarray, (proposals[left], self.SCENE, noise[left], values[left]))
        )
        del got["hcpg random"]  # its direction is drawn from the lots, of which one is missing there
        for rule, (action, seen) in got.items():
            expected, expected_seen = wanted[rule]
            np.testing.assert_allclose(seen.weights, [0.0, *expected_seen.weights], atol=1e-6, err_msg=rule)
            np.testing.assert_allclose(action, expected, atol=1e-6, err_msg=rule)
            np.testing.assert_allclose(seen.spread, expected_seen.spread, atol=1e-6, err_msg=rule)
            np.testing.assert_allclose(seen.blend_gap, expected_seen.blend_gap, atol=1e-6, err_msg=rule)

    @pytest.mark.parametrize("bad", [jnp.nan, jnp.inf, -jnp.inf])
    def test_bad_lots_and_values_leave_their_candidates_out(self, bad):
        numbers = jnp.array([0.9, 0.1, 0.2, 0.3]).at[0].set(bad)
        got = COMPILED(jnp.full((4, 4), 0.5), self.SCENE, numbers, numbers)
        for rule in ("random", "value"):
            assert got[rule][1].weights.tolist() == [0.0, 0.0, 0.0, 1.0]
        for rule in ("permuted", "value_soft"):
            assert got[rule][1].weights[0] == 0.0

    def test_without_a_good_candidate_the_action_is_not_a_number(self):
        got = COMPILED(jnp.full((4, 4), jnp.nan), self.SCENE, jnp.zeros(4), jnp.zeros(4))
        for action, seen in got.values():
            assert np.isnan(action).all()
            assert seen.weights.tolist() == [0.0] * 4

    def test_constants_inside_a_traced_function_are_taken_as_they_are(self):
        action = jax.jit(lambda p: select(p, self.SCENE)[0])(jnp.full((4, 4), 0.5))
        assert action.tolist() == [0.5] * 4

    def test_a_scene_that_is_not_finite_leaves_no_candidate(self):
        compiled = jax.jit(lambda scene: select(jnp.zeros((4, 4)), scene)[0])
        assert np.isnan(compiled(self.SCENE._replace(approach=jnp.full(3, jnp.nan)))).all()

    def test_shapes_are_checked_all_the_same(self, unchecked):
        with pytest.raises(ValueError, match=r"scene.approach has shape \(3,\)"):
            jax.jit(lambda p: select(p, self.SCENE))(jnp.zeros((2, 4, 4)))
