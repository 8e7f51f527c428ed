"""One code for three array libraries: which functions to call, and arithmetic that cannot overflow."""

import importlib
import sys
from importlib.util import find_spec
from typing import Any

import numpy

from hcpg.types import Float, Int, Tensor


def namespace(*arrays: Tensor) -> Any:
    """The functions for these arrays: `numpy`, `jax.numpy` or PyTorch's under the array API's names.

    NumPy arrays mix with either of the other two, whose functions are then returned.

    Raises:
        TypeError: an argument is no such array, or JAX and PyTorch are mixed.
        ImportError: a PyTorch tensor, without the package that gives PyTorch the array API's names.
    """
    if all(isinstance(array, numpy.ndarray) for array in arrays):
        return numpy
    found = {_owner(array): array for array in arrays}
    if "torch" in found and "jax" in found:
        raise TypeError("JAX and PyTorch arrays are mixed; convert them to one of the two")
    if "torch" in found:
        return _torch_namespace()
    return found["jax"].__array_namespace__() if "jax" in found else numpy


def is_traced(array: Tensor) -> bool:
    """Whether the array has no numbers to look at, because JAX is tracing (`jit`, `vmap`, `scan`)."""
    jax = sys.modules.get("jax")
    return jax is not None and isinstance(array, jax.core.Tracer)


def dtype_name(array: Tensor) -> str:
    """`float32` and the like, the same for all three libraries."""
    return str(array.dtype).removeprefix("torch.")


def like(array: Tensor, reference: Tensor) -> Tensor:
    """`array` in the library, dtype and device of `reference`; what its dtype cannot hold saturates."""
    if isinstance(reference, numpy.ndarray) and array.dtype is reference.dtype:
        return array
    if dtype_name(array) == "float64" and dtype_name(reference) == "float32":
        largest = float(numpy.finfo(numpy.float32).max)
        array = namespace(array).clip(array, -largest, largest)
    if _owner(reference) != "torch":
        return namespace(reference).asarray(array, dtype=reference.dtype)
    # PyTorch takes no read-only array and no negative stride, so it gets a copy of its own.
    own = array if _owner(array) == "torch" else namespace(reference).asarray(numpy.array(array, order="C"))
    return own.to(reference)


def bounded(array: Float[Tensor, "*shape"], divisor: float) -> Float[Tensor, "*shape"]:
    """`array` within plus and minus the dtype's largest number / `divisor`, so that sums stay finite.

    From a divisor of 16 on, its reciprocals survive too: a compiler may multiply by them, and the
    reciprocal of the largest number is so small that hardware rounds it to 0.
    """
    xp = namespace(array)
    limit = float(xp.finfo(array.dtype).max) / divisor
    return xp.clip(array, -limit, limit)


def length(vector: Float[Tensor, "*batch D"]) -> Float[Tensor, "*batch"]:
    """Euclidean norm over the last axis, of a `bounded` vector; its squares neither overflow nor vanish."""
    xp = namespace(vector)
    largest = xp.max(xp.abs(vector), axis=-1, keepdims=True)
    unit = xp.where(largest > 0, largest, 1.0)
    return (unit * xp.sqrt(xp.sum((vector / unit) ** 2, axis=-1, keepdims=True)))[..., 0]


def ranks(numbers: Float[Tensor, "*batch K"]) -> Int[Tensor, "*batch K"]:
    """0 for the largest of each set, K - 1 for the smallest; of equals, the lowest index comes first."""
    xp = namespace(numbers)
    order = xp.argsort(-numbers, axis=-1, stable=True)
    return xp.argsort(order, axis=-1, stable=True)


def _owner(array: Tensor) -> str:
    package = type(array).__module__.partition(".")[0]
    if package == "torch":
        return "torch"
    if hasattr(array, "__array_namespace__"):
        return "jax" if package.startswith("jax") else "numpy"
    raise TypeError(f"{type(array).__name__} is no array; give one of NumPy, JAX or PyTorch")


def _torch_namespace() -> Any:
    if find_spec("array_api_compat") is None:
        raise ImportError('PyTorch tensors need one more package: pip install "hcpg-flow[torch]"')
    return importlib.import_module("array_api_compat.torch")
