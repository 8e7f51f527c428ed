"""Floating-point operations of the matrix products of a traced function, two per multiply-add."""

from collections.abc import Callable
from math import prod
from typing import Any

import jax
from jax.extend import core


def count(function: Callable[..., Any], *arguments: Any, branch_share: float = 1.0) -> float:
    """Operations of one call; of a branch (`lax.cond`) the larger side, times `branch_share`."""
    return _of(jax.make_jaxpr(function)(*arguments).jaxpr, branch_share)


def _of(jaxpr: core.Jaxpr, branch_share: float) -> float:
    return sum(_of_equation(equation, branch_share) for equation in jaxpr.eqns)


def _of_equation(equation: core.JaxprEqn, branch_share: float) -> float:
    name, parameters = equation.primitive.name, equation.params
    if name == "dot_general":
        (contracted, _), _ = parameters["dimension_numbers"]
        left = equation.invars[0].aval.shape
        return 2.0 * prod(equation.outvars[0].aval.shape) * prod(left[axis] for axis in contracted)
    if name == "cond":
        return branch_share * max(_of(branch.jaxpr, branch_share) for branch in parameters["branches"])
    inner = sum(_of(each, branch_share) for each in _inner(parameters))
    return inner * parameters.get("length", 1) if name == "scan" else inner


def _inner(parameters: dict[str, Any]) -> list[core.Jaxpr]:
    """The traced functions that an equation calls; of one given in several forms, the first."""
    for name in ("jaxpr", "call_jaxpr", "fun_jaxpr", "body_jaxpr"):
        if name in parameters:
            return [getattr(parameters[name], "jaxpr", parameters[name])]
    return []
