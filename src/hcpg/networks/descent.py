"""Gradient steps and moving averages of parameters, the same for every network and every method."""

import jax
import optax
from jaxtyping import PyTree


def rest(optimizer: optax.GradientTransformation, parameters: PyTree) -> PyTree:
    """The optimizer's state before the first step."""
    return optimizer.init(parameters)


def descend(
    optimizer: optax.GradientTransformation, gradient: PyTree, optimizer_state: PyTree, parameters: PyTree
) -> tuple[PyTree, PyTree]:
    """The parameters after one step of the optimizer, and the optimizer's state after it."""
    step, optimizer_state = optimizer.update(gradient, optimizer_state)
    return optax.apply_updates(parameters, step), optimizer_state


def follow(target: PyTree, online: PyTree, rate: float) -> PyTree:
    """`target` moved towards `online`: (1 - rate) * target + rate * online."""
    return jax.tree.map(lambda old, new: (1 - rate) * old + rate * new, target, online)
