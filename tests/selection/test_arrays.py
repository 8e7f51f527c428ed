import jax
import jax.numpy as jnp
import numpy as np
import pytest
import torch

from hcpg.selection import arrays


def test_each_library_gets_its_own_functions():
    assert arrays.namespace(np.zeros(3)) is np
    assert arrays.namespace(jnp.zeros(3)) is jnp
    assert arrays.namespace(torch.zeros(3)).__name__ == "array_api_compat.torch"


def test_numpy_arrays_follow_the_library_they_are_mixed_with():
    assert arrays.namespace(np.zeros(3), jnp.zeros(3)) is jnp
    assert arrays.namespace(np.zeros(3), torch.zeros(3)).__name__ == "array_api_compat.torch"


def test_jax_and_pytorch_do_not_mix():
    with pytest.raises(TypeError, match="JAX and PyTorch arrays are mixed"):
        arrays.namespace(jnp.zeros(3), torch.zeros(3))


def test_a_list_is_no_array():
    with pytest.raises(TypeError, match="list is no array"):
        arrays.namespace([1.0, 2.0])


def test_pytorch_without_its_helper_names_the_extra_to_install(monkeypatch):
    monkeypatch.setattr(arrays, "find_spec", lambda name: None)
    with pytest.raises(ImportError, match=r'pip install "hcpg-flow\[torch\]"'):
        arrays.namespace(torch.zeros(3))


def test_only_arrays_inside_jit_and_vmap_are_traced():
    seen = []
    jax.jit(lambda array: seen.append(arrays.is_traced(array)))(jnp.zeros(2))
    jax.vmap(lambda array: seen.append(arrays.is_traced(array)))(jnp.zeros((2, 2)))
    outside = [arrays.is_traced(array) for array in (jnp.zeros(2), np.zeros(2), torch.zeros(2))]
    assert (seen, outside) == ([True, True], [False, False, False])


def test_a_double_too_large_for_a_float_saturates():
    narrow = arrays.like(np.array([1e300, -1e300, 2.5]), np.zeros(1, np.float32))
    assert narrow.dtype == np.float32
    assert narrow.tolist() == [np.finfo(np.float32).max, np.finfo(np.float32).min, 2.5]


@pytest.mark.parametrize("scale", [1e-320, 1e-200, 1.0, 1e200, 1e307])
def test_the_length_of_three_four_is_five_at_every_scale(scale):
    # 1e-320 is subnormal: three digits are left of it.
    assert arrays.length(np.array([3.0, 4.0, 0.0]) * scale) == pytest.approx(5.0 * scale, rel=2e-3)


def test_the_length_of_nothing_is_zero():
    assert arrays.length(np.zeros((2, 3))).tolist() == [0.0, 0.0]


def test_ranks_count_from_the_largest_and_break_ties_by_index():
    assert arrays.ranks(np.array([[0.5, 2.0, 2.0, -1.0]])).tolist() == [[2, 0, 1, 3]]


def test_pytorch_takes_a_reversed_read_only_numpy_array():
    turned = np.arange(3.0)[::-1]
    turned.flags.writeable = False
    assert arrays.like(turned, torch.zeros(1)).tolist() == [2.0, 1.0, 0.0]


def test_pytorch_gets_the_device_of_the_reference():
    # The meta device has shapes and no numbers.
    moved = arrays.like(np.zeros(3), torch.zeros(2, device="meta"))
    assert (moved.device.type, moved.dtype, tuple(moved.shape)) == ("meta", torch.float32, (3,))
