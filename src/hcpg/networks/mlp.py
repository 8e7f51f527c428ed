"""A plain stack of dense layers, and several of them as one."""

from collections.abc import Callable, Sequence

import equinox as eqx
import jax
from jaxtyping import Array, Float, PRNGKeyArray

from hcpg.networks.dense import LECUN_NORMAL, Dense, Initializer

Activation = Callable[[Array], Array]


class MLP(eqx.Module):
    """[dense -> activation] for every hidden layer, then dense."""

    layers: list[Dense]
    activation: Activation = eqx.field(static=True)

    @classmethod
    def create(
        cls,
        key: PRNGKeyArray,
        sizes: Sequence[int],
        activation: Activation = jax.nn.relu,
        initializer: Initializer = LECUN_NORMAL,
    ) -> "MLP":
        """A fresh stack; `sizes` runs from inputs to outputs.

        Pass module-level functions as `activation`: two networks are compared by it.
        """
        keys = jax.random.split(key, len(sizes) - 1)
        shapes = zip(keys, sizes[:-1], sizes[1:], strict=True)
        layers = [Dense.create(each, inputs, outputs, initializer) for each, inputs, outputs in shapes]
        return cls(layers, activation)

    def __call__(self, x: Float[Array, "*batch I"]) -> Float[Array, "*batch outputs"]:
        """The last layer's output, without an activation."""
        for layer in self.layers[:-1]:
            x = self.activation(layer(x))
        return self.layers[-1](x)


def ensemble(create: Callable[[PRNGKeyArray], eqx.Module], key: PRNGKeyArray, members: int) -> eqx.Module:
    """`members` independent networks, stacked along the first axis of every parameter."""
    return jax.vmap(create)(jax.random.split(key, members))


def evaluate(networks: eqx.Module, x: Float[Array, "*batch I"]) -> Float[Array, "N *batch outputs"]:
    """The output of each member of an ensemble for the same input."""
    return jax.vmap(lambda network: network(x))(networks)
