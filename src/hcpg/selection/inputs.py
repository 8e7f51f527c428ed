"""What a caller hands to `select`, checked and brought into one array library, dtype and device."""

from typing import NamedTuple

import numpy

from hcpg.selection.arrays import dtype_name, is_traced, like, namespace
from hcpg.selection.selectors import Selector
from hcpg.types import Float, Scene, Tensor


class Inputs(NamedTuple):
    """The numbers a selection is computed from; what the rule does not read is None."""

    proposals: Float[Tensor, "*batch K A"]
    approach: Float[Tensor, "*batch 3"]
    task: Float[Tensor, "*batch 3"]
    contact: Float[Tensor, "*batch"] | None
    noise: Float[Tensor, "*batch K"] | None
    values: Float[Tensor, "*batch K"] | None


def gather(
    proposals: Tensor, scene: Scene, selector: Selector, noise: Tensor | None, values: Tensor | None
) -> Inputs:
    """The inputs in the dtype and on the device of `proposals`; of the scene, what the score reads.

    Numbers are looked at only where they exist: while JAX traces, only shapes and dtypes are checked.

    Raises:
        TypeError: proposals that are no array, or are neither float32 nor float64.
        ValueError: a shape that does not fit, a number that is not finite, or noise or values that the
            rule needs and that are missing.
    """
    _check_proposals(proposals, selector)
    _check_given("noise", noise, selector.needs_noise, selector)
    _check_given("values", values, selector.needs_values, selector)
    *batch, candidates, _ = proposals.shape
    parts = {
        "scene.approach": (scene.approach, (*batch, 3)),
        "scene.task": (scene.task, (*batch, 3)),
        "scene.contact": (scene.contact, (*batch,)),
        "noise": (noise if selector.needs_noise else None, (*batch, candidates)),
        "values": (values if selector.needs_values else None, (*batch, candidates)),
    }
    arrays = {name: _array(name, part, shape, proposals) for name, (part, shape) in parts.items()}
    given = [array for array in arrays.values() if array is not None]
    xp = namespace(proposals, *given)
    reference = proposals if xp is namespace(proposals) else xp.asarray(proposals)
    return Inputs(reference, *(part if part is None else like(part, reference) for part in arrays.values()))


def _check_proposals(proposals: Tensor, selector: Selector) -> None:
    namespace(proposals)  # refuses what is no array
    if dtype_name(proposals) not in ("float32", "float64"):
        raise TypeError(f"proposals are {dtype_name(proposals)}; convert them to float32 or float64")
    if proposals.ndim < 2 or proposals.shape[-2] < 1:
        shape = tuple(proposals.shape)
        raise ValueError(f"proposals have shape {shape}; give [..., K, A] with at least K = 1 candidate")
    size, stop = proposals.shape[-1], selector.translation[1]
    if size < stop:
        raise ValueError(
            f"proposals have {size} numbers per action, but the translation is the slice "
            f"{selector.translation}; set Selector(translation=...) to where x, y, z are"
        )
    _check_finite("proposals", proposals, "look at the policy that made them")


def _check_given(name: str, part: Tensor | None, needed: bool, selector: Selector) -> None:
    if needed and part is None:
        asks = f"rule {selector.rule!r} with direction {selector.direction!r}"
        raise ValueError(f"{asks} needs {name}: give {name}=[..., K], one per proposal")


def _array(name: str, part: Tensor | None, shape: tuple[int, ...], proposals: Tensor) -> Tensor | None:
    if part is None:
        return None
    array = part if hasattr(part, "dtype") else numpy.asarray(part, dtype=float)
    if tuple(array.shape) != shape:
        raise ValueError(
            f"{name} has shape {tuple(array.shape)}; proposals {tuple(proposals.shape)} call for {shape}"
        )
    _check_finite(name, array, "look at where it was read")
    return array


def _check_finite(name: str, array: Tensor, cure: str) -> None:
    xp = namespace(array)
    finite = xp.all(xp.isfinite(array))
    # The answer is traced even where the array is a constant inside a traced function.
    if not is_traced(finite) and not bool(finite):
        raise ValueError(f"not every number of {name} is finite; {cure}")
