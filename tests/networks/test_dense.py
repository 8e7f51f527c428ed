"""The dense layer: its product by hand, its initial scale by statistics."""

import jax
import numpy as np
from jax import numpy as jnp

from hcpg.networks.dense import Dense


def test_it_is_a_matrix_product_plus_a_bias_over_the_last_axis():
    layer = Dense(jnp.array([[1.0, 2.0], [3.0, 4.0]]), jnp.array([10.0, 20.0]))
    np.testing.assert_array_equal(layer(jnp.array([[[1.0, 1.0]], [[2.0, 0.0]]])), [[[14, 26]], [[12, 24]]])


def test_kernels_start_as_lecun_normal_and_biases_at_zero():
    layer = Dense.create(jax.random.key(0), 400, 500)
    assert abs(float(layer.kernel.std()) - 1 / 20) < 0.0005  # sqrt(1 / 400); 200,000 draws
    assert (
        float(abs(layer.kernel).max()) < 2 / 20 / 0.8796 + 1e-6
    )  # truncated at two deviations, then rescaled
    assert not layer.bias.any()


def test_a_constant_layer_answers_its_bias():
    layer = Dense.constant(3, 2, 5.0)
    np.testing.assert_array_equal(layer(jnp.full((4, 3), 7.0)), np.full((4, 2), 5.0))
