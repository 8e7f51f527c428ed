import jax.numpy as jnp
import numpy as np
import pytest
import torch

from hcpg.selection import Scene, Selector, select

PROPOSALS = np.full((4, 4), 0.5)


def scene_of(size, contact=None):
    return Scene.of(*np.arange(3 * size, dtype=float).reshape(3, size), contact=contact)


@pytest.mark.usefixtures("unchecked")
class TestRefused:
    @pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
    @pytest.mark.parametrize("convert", [np.asarray, jnp.asarray, torch.asarray])
    def test_proposals_that_are_not_finite(self, bad, convert):
        proposals = PROPOSALS.copy()
        proposals[2, 3] = bad
        with pytest.raises(ValueError, match="not every number of proposals is finite"):
            select(convert(proposals), scene_of(3))

    @pytest.mark.parametrize("part", ["approach", "task", "contact"])
    def test_a_scene_that_is_not_finite(self, part):
        scene = scene_of(3, contact=np.array(0.0))
        broken = scene._replace(**{part: getattr(scene, part) * np.nan})
        with pytest.raises(ValueError, match=rf"not every number of scene\.{part} is finite"):
            select(PROPOSALS, broken)

    def test_no_candidate(self):
        with pytest.raises(ValueError, match=r"shape \(0, 4\); give \[..., K, A\] with at least K = 1"):
            select(np.zeros((0, 4)), scene_of(3))

    def test_one_action_instead_of_a_set(self):
        with pytest.raises(ValueError, match=r"shape \(4,\); give \[..., K, A\]"):
            select(np.zeros(4), scene_of(3))

    def test_actions_too_short_for_a_translation(self):
        with pytest.raises(
            ValueError, match=r"2 numbers per action, but the translation is the slice \(0, 3\)"
        ):
            select(np.zeros((4, 2)), scene_of(3))

    def test_a_flat_scene(self):
        with pytest.raises(ValueError, match=r"scene.approach has shape \(2,\); .* call for \(3,\)"):
            select(PROPOSALS, scene_of(2))

    def test_one_scene_for_many_sets(self):
        with pytest.raises(ValueError, match=r"scene.approach has shape \(3,\); .* call for \(5, 3\)"):
            select(np.zeros((5, 4, 4)), scene_of(3))

    def test_one_flag_too_many(self):
        with pytest.raises(ValueError, match=r"scene.contact has shape \(2,\); .* call for \(\)"):
            select(PROPOSALS, scene_of(3, contact=np.zeros(2)))

    @pytest.mark.parametrize("dtype", [np.int64, np.float16, bool])
    def test_numbers_that_are_no_float(self, dtype):
        with pytest.raises(TypeError, match=f"proposals are {np.dtype(dtype).name}; convert them to float32"):
            select(np.zeros((4, 4), dtype), scene_of(3))

    def test_a_list(self):
        with pytest.raises(TypeError, match="list is no array"):
            select([[0.0, 0.0, 0.0]], scene_of(3))

    @pytest.mark.parametrize(
        ("rule", "missing"), [("random", "noise"), ("permuted", "noise"), ("value", "values")]
    )
    def test_a_rule_without_what_it_needs(self, rule, missing):
        with pytest.raises(ValueError, match=rf"rule '{rule}' .* needs {missing}: give {missing}=\[..., K\]"):
            select(PROPOSALS, scene_of(3), rule)

    def test_a_random_direction_without_lots(self):
        with pytest.raises(ValueError, match=r"direction 'random' needs noise: give noise=\[..., K\]"):
            select(PROPOSALS, scene_of(3), Selector(direction="random"))

    def test_values_of_other_candidates(self):
        with pytest.raises(ValueError, match=r"values has shape \(3,\); .* call for \(4,\)"):
            select(PROPOSALS, scene_of(3), "value", values=np.zeros(3))

    def test_values_that_are_not_finite(self):
        with pytest.raises(ValueError, match="not every number of values is finite"):
            select(PROPOSALS, scene_of(3), "value", values=np.array([0.0, np.nan, 0.0, 0.0]))


def test_what_the_rule_does_not_read_is_ignored():
    selector = Selector(rule="first")
    action, _ = select(PROPOSALS, scene_of(3), selector, noise=np.full(4, np.nan), values=np.full(4, np.inf))
    assert action.tolist() == [0.5] * 4


@pytest.mark.parametrize("flag", [True, 1, 1.0, np.True_, np.float32(1.0)])
def test_a_plain_flag_will_do(flag):
    _, seen = select(PROPOSALS, scene_of(3, contact=flag))
    assert seen.phase == 1.0


def test_the_scene_follows_the_proposals_library_and_dtype():
    action, seen = select(torch.asarray(PROPOSALS).float(), scene_of(3, contact=True))
    assert {type(part) for part in (action, *seen)} == {torch.Tensor}
    assert {part.dtype for part in (action, *seen)} == {torch.float32}


def test_a_scene_in_double_precision_may_exceed_single_precision():
    scene = Scene.of(np.zeros(3), np.array([1e300, 0.0, 0.0]), np.zeros(3))
    _, seen = select(np.array([[0.5, 0.0, 0.0]], np.float32), scene)
    assert seen.scores == pytest.approx([0.475])
