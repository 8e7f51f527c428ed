import numpy as np
import pytest
from scipy.stats import kstest

from hcpg.selection import RULES, Scene, Selector, select
from hcpg.selection.progress import random_direction


def everything(generator, *batch, count=4, size=7):
    """Proposals, a scene with a flag, and what the other rules need."""
    points = generator.normal(size=(3, *batch, 3))
    scene = Scene.of(*points, contact=generator.uniform(size=batch))
    extras = {
        "noise": generator.uniform(size=(*batch, count)),
        "values": generator.normal(size=(*batch, count)),
    }
    return generator.uniform(-1, 1, (*batch, count, size)), scene, extras


def test_two_proposals_by_hand(flagged_scene):
    # Scores .5 - .025 and -.5 - .025; two candidates weigh .9457 and .0543.
    proposals = np.array([[0.5, 0.0, 0.0, 1.0], [-0.5, 0.0, 0.0, -1.0]])
    action, seen = select(proposals, flagged_scene)
    assert seen.scores == pytest.approx([0.475, -0.525])
    assert seen.weights == pytest.approx([0.9457, 0.0543], abs=5e-5)
    assert action == pytest.approx([0.4457, 0.0, 0.0, 0.8914], abs=1e-4)
    assert seen.phase == 0.0
    # Each lies sqrt(.25 + 1) from the mean; the blend lies .0543 * 2 * sqrt(1.25) from the first.
    assert seen.spread == pytest.approx(1.25**0.5)
    assert seen.blend_gap == pytest.approx(0.0543 * 2 * 1.25**0.5, abs=2e-4)


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_single_proposal_comes_back_bit_for_bit(rule, dtype, generator):
    for _ in range(50):
        proposals, scene, extras = everything(generator, count=1)
        proposals = proposals.astype(dtype)
        proposals[0, 3] = -0.0
        action, seen = select(proposals, scene, rule, **extras)
        assert action.tobytes() == proposals[0].tobytes()
        assert (seen.weights.tolist(), seen.spread, seen.blend_gap) == ([1.0], 0.0, 0.0)


def test_the_first_of_four_comes_back_bit_for_bit(generator):
    proposals, scene, _ = everything(generator, 100)
    action, _ = select(proposals.astype(np.float32), scene, "first")
    assert action.tobytes() == proposals[:, 0].astype(np.float32).tobytes()


def test_environments_do_not_mix(generator):
    """Actors that ignore their noise: environment e always proposes the constant e / 10."""
    _, scene, _ = everything(generator, 6)
    constants = np.arange(6) / 10.0
    proposals = np.broadcast_to(constants[:, None, None], (6, 4, 7)).copy()
    action, seen = select(proposals, scene)
    assert action.tolist() == np.broadcast_to(constants[:, None], (6, 7)).tolist()
    assert seen.spread == pytest.approx(np.zeros(6), abs=1e-15)


@pytest.mark.parametrize("rule", RULES)
def test_a_batch_is_its_sets_one_by_one(rule, generator):
    proposals, scene, extras = everything(generator, 2, 3)
    action, seen = select(proposals, scene, rule, **extras)
    for place in np.ndindex(2, 3):
        one = Scene(*(part[place] for part in scene))
        alone, alone_seen = select(
            proposals[place], one, rule, **{name: x[place] for name, x in extras.items()}
        )
        assert action[place] == pytest.approx(alone, abs=1e-14)
        for whole, single in zip(seen, alone_seen, strict=True):
            assert whole[place] == pytest.approx(single, abs=1e-14)


def test_scaling_all_translations_leaves_the_weights(generator):
    proposals, scene, _ = everything(generator, 30)
    smaller = proposals.copy()
    smaller[..., :3] *= 0.01
    assert select(smaller, scene)[1].weights == pytest.approx(select(proposals, scene)[1].weights, abs=1e-12)


def test_scaling_the_scene_leaves_the_weights(generator):
    proposals, scene, _ = everything(generator, 30)
    larger = scene._replace(approach=scene.approach * 50.0, task=scene.task * 0.02)
    assert select(proposals, larger)[1].weights == pytest.approx(
        select(proposals, scene)[1].weights, abs=1e-12
    )


def test_permuting_the_proposals_permutes_the_weights_and_leaves_the_action(generator):
    proposals, scene, _ = everything(generator, 30)
    order = np.array([3, 1, 0, 2])
    action, seen = select(proposals, scene)
    other, other_seen = select(proposals[:, order], scene)
    assert other_seen.weights == pytest.approx(seen.weights[:, order], abs=1e-12)
    assert other == pytest.approx(action, abs=1e-12)


def test_nearly_identical_proposals_weigh_differently_and_blend_to_the_common_action(generator):
    _, scene, _ = everything(generator, 30)
    common = generator.uniform(-0.9, 0.9, size=(30, 1, 7))
    action, seen = select(common + 1e-4 * generator.normal(size=(30, 4, 7)), scene)
    assert seen.weights.max(axis=-1).mean() > 0.6
    assert action == pytest.approx(common[:, 0], abs=5e-4)


def test_at_the_object_the_smallest_move_wins(generator):
    proposals, scene, _ = everything(generator, 30)
    arrived = scene._replace(approach=0 * scene.approach, contact=0 * scene.contact)
    _, seen = select(proposals, arrived)
    smallest = np.argmin(np.linalg.norm(proposals[..., :3], axis=-1), axis=-1)
    assert (np.argmax(seen.weights, axis=-1) == smallest).all()


def test_the_action_lies_in_the_convex_hull(generator):
    proposals, scene, _ = everything(generator, 30)
    action, seen = select(proposals, scene)
    assert (seen.weights >= 0).all()
    assert seen.weights.sum(axis=-1) == pytest.approx(np.ones(30))
    assert action == pytest.approx(np.einsum("ek,eka->ea", seen.weights, proposals), abs=1e-12)
    assert (action >= proposals.min(axis=1)).all()
    assert (action <= proposals.max(axis=1)).all()


def test_proposals_beyond_the_bounds_are_blended_and_then_clipped(flagged_scene):
    proposals = np.array([[3.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
    # .94569 * 3 - .05431
    assert select(proposals, flagged_scene)[0] == pytest.approx([1.0, 0.0, 0.0])
    assert select(proposals, flagged_scene, Selector(bounds=None))[0] == pytest.approx(
        [2.7827, 0, 0], abs=1e-4
    )
    assert select(proposals, flagged_scene, Selector(bounds=(-2.0, 2.0)))[0] == pytest.approx([2.0, 0.0, 0.0])


def test_the_spread_and_the_gap_are_distances(generator):
    proposals, scene, _ = everything(generator, 30)
    action, seen = select(proposals, scene)
    offsets = proposals - proposals.mean(axis=1, keepdims=True)
    assert seen.spread == pytest.approx(np.sqrt(np.mean(np.sum(offsets**2, axis=-1), axis=-1)))
    assert seen.blend_gap == pytest.approx(np.linalg.norm(action[:, None] - proposals, axis=-1).min(axis=-1))


def test_after_contact_the_task_decides(flagged_scene):
    toward_object, toward_goal = [0.5, 0.0, 0.0], [0.0, 0.5, 0.0]
    proposals = np.array([toward_object, toward_goal])
    grasped = flagged_scene._replace(contact=np.array(1.0))
    assert np.argmax(select(proposals, flagged_scene)[1].weights) == 0
    assert np.argmax(select(proposals, grasped)[1].weights) == 1


def test_opposed_scores_are_those_of_the_scene_turned_round(generator):
    proposals, scene, _ = everything(generator, 20)
    turned = scene._replace(approach=-scene.approach, task=-scene.task)
    _, seen = select(proposals, scene, Selector(direction="opposed"))
    _, expected = select(proposals, turned)
    assert seen.scores.tolist() == expected.scores.tolist()
    assert seen.phase.tolist() == expected.phase.tolist()


def test_random_directions_know_nothing_of_the_scene_but_its_phase(generator):
    proposals, scene, extras = everything(generator, 20)
    other = everything(generator, 20)[1]._replace(contact=scene.contact)
    rule = Selector(direction="random", action_penalty=0.0)
    action, seen = select(proposals, scene, rule, noise=extras["noise"])
    assert action.tolist() == select(proposals, other, rule, noise=extras["noise"])[0].tolist()
    assert seen.phase.tolist() == scene.contact.tolist()
    # Lots .5 and .25: height 0, a quarter of the way round, so the score is the step along +y.
    one = Scene(*(part[0] for part in scene))
    _, along_y = select(proposals[0], one, rule, noise=np.array([0.5, 0.9, 0.9, 0.25]))
    assert along_y.scores == pytest.approx(proposals[0, :, 1], abs=1e-12)


def test_random_directions_are_uniform_over_the_sphere(generator):
    found = random_direction(generator.uniform(size=(20_000, 4)))
    assert np.linalg.norm(found, axis=1) == pytest.approx(np.ones(20_000))
    assert abs(found.mean(axis=0)).max() < 4 / (3 * 20_000) ** 0.5  # four standard errors
    # Each coordinate of such a vector is uniform on [-1, 1].
    assert all(kstest(column, "uniform", (-1, 2)).pvalue > 1e-3 for column in found.T)
