"""Layer normalisation by hand, the stacks against PyTorch, their start against Xavier's bounds."""

import jax
import numpy as np
import torch
from jax import numpy as jnp

from hcpg.networks.layer_norm import GELU, LayerNorm, LayerNormMLP, value_tower, velocity_field
from hcpg.networks.mlp import ensemble, evaluate


def moved(network, seed):
    """Every parameter off its start."""
    leaves, structure = jax.tree.flatten(network)
    generator = np.random.default_rng(seed)
    shifted = [leaf + 0.3 * generator.normal(size=leaf.shape).astype(np.float32) for leaf in leaves]
    return jax.tree.unflatten(structure, shifted)


def in_torch(network, activations, x):
    """The same stack out of torch's own layers, in float64."""
    modules = []
    for index, layer in enumerate(network.layers):
        inputs, outputs = layer.kernel.shape
        modules.append(torch.nn.Linear(inputs, outputs).double())
        parameters = {"weight": layer.kernel.T, "bias": layer.bias}
        if index < len(activations):
            modules += [torch.nn.LayerNorm(outputs).double(), activations[index]]
            norm = {"weight": network.norms[index].gain, "bias": network.norms[index].bias}
            modules[-2].load_state_dict({name: torch.tensor(np.array(each)) for name, each in norm.items()})
        own = modules[-3] if index < len(activations) else modules[-1]
        own.load_state_dict({name: torch.tensor(np.array(each)) for name, each in parameters.items()})
    return torch.nn.Sequential(*modules)(torch.tensor(np.array(x)).double()).detach().numpy()


def test_a_row_is_normalised_over_its_features_then_scaled_and_shifted():
    norm = LayerNorm(jnp.array([1.0, 1.0, 2.0]), jnp.array([0.0, 0.5, 0.0]))
    root = np.sqrt(1.5)  # of 1, 2, 3 the mean is 2 and the variance 2/3
    np.testing.assert_allclose(norm(jnp.array([1.0, 2.0, 3.0])), [-root, 0.5, 2 * root], rtol=1e-4)


def test_a_row_without_spread_becomes_the_bias():
    np.testing.assert_array_equal(LayerNorm(jnp.ones(2), jnp.full(2, 7.0))(jnp.full((3, 2), 5.0)), 7.0)


def test_a_row_far_from_zero_keeps_its_digits():
    found = LayerNorm.create(2)(jnp.array([4096.0, 4098.0]))
    np.testing.assert_allclose(found, [-1.0, 1.0], rtol=1e-4)  # mean of squares less square: off by far


def test_gelu_is_the_exact_one():
    np.testing.assert_allclose(GELU(jnp.array([1.0, -3.0])), [0.8413447, -0.0040497], rtol=1e-4)


def test_a_tower_equals_torchs():
    network = moved(value_tower(jax.random.key(0), 6, 8), 1)
    x = jax.random.normal(jax.random.key(1), (5, 6))
    linear, gelu = torch.nn.Identity(), torch.nn.GELU()
    expected = in_torch(network, [linear, gelu, gelu, linear], x)
    assert expected.shape == (5, 1)
    np.testing.assert_allclose(network(x), expected, rtol=1e-4, atol=1e-5)


def test_a_velocity_field_equals_torchs():
    network = moved(velocity_field(jax.random.key(0), 6, 3, 8), 1)
    x = jax.random.normal(jax.random.key(1), (5, 6))
    expected = in_torch(network, [torch.nn.ELU(), torch.nn.ELU()], x)
    assert expected.shape == (5, 3)
    np.testing.assert_allclose(network(x), expected, rtol=1e-4, atol=1e-5)


def test_kernels_start_within_xaviers_bounds_the_last_one_too_and_biases_at_zero():
    sizes = (40, 80, 20)
    network = LayerNormMLP.create(jax.random.key(0), sizes, (jax.nn.elu,))
    for layer, fans in zip(network.layers, (120, 100), strict=True):
        bound = np.sqrt(6 / fans)
        assert 0.98 * bound < float(abs(layer.kernel).max()) <= bound
        np.testing.assert_allclose(layer.kernel.std(), bound / np.sqrt(3), rtol=0.05)
        assert float(abs(layer.bias).max()) == 0.0
    assert float(network.norms[0].gain.min()) == 1.0
    assert float(abs(network.norms[0].bias).max()) == 0.0


def test_a_towers_twin_answers_as_if_alone():
    twins = moved(ensemble(lambda key: value_tower(key, 6, 8), jax.random.key(0), 2), 2)
    x = jax.random.normal(jax.random.key(1), (5, 6))
    found = evaluate(twins, x)
    for index in (0, 1):
        alone = jax.tree.map(lambda leaf, index=index: leaf[index], twins)
        np.testing.assert_allclose(alone(x), found[index], atol=1e-5)
    assert float(abs(found[0] - found[1]).min()) > 0
