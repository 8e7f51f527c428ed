"""Twin critics in two recipes: `crossq` (batch renorm, no target) and `polyak` (target networks)."""

from typing import NamedTuple, Protocol, runtime_checkable

import equinox as eqx
import jax
from jax import numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray, PyTree

from hcpg.networks.batch_renorm import BatchRenorm, Moments, observe, standardise
from hcpg.networks.dense import Dense
from hcpg.networks.descent import follow
from hcpg.types import Batch

Values = Float[Array, "N B"]


class CriticState(NamedTuple):
    """What a critic recipe learns."""

    networks: PyTree
    """Parameters that gradients move, stacked over the N critics."""
    moments: PyTree
    """Running statistics: of every layer's input (crossq), of the critics' input (polyak)."""
    target: PyTree
    """Averaged parameters (polyak), else empty."""


class Target(NamedTuple):
    """What the next state adds to the Bellman target."""

    actions: Float[Array, "B A"]
    entropy_bonus: Float[Array, " B"]
    """-temperature * log-probability of those actions."""
    discount: float


@runtime_checkable
class Critics(Protocol):
    """A recipe for twin critics."""

    def init(self, key: PRNGKeyArray, inputs: int) -> CriticState:
        """Fresh critics for concatenated observation and action."""
        ...

    def loss(
        self, networks: PyTree, state: CriticState, batch: Batch, following: Target
    ) -> tuple[Float[Array, ""], tuple[CriticState, Values]]:
        """The loss of `networks`, the state with new statistics, and their values."""
        ...

    def values(self, state: CriticState, inputs: Float[Array, "B I"]) -> Values:
        """The critics' values in inference mode, which leaves the statistics alone."""
        ...

    def follow(self, state: CriticState) -> CriticState:
        """The state after the targets moved, once per update."""
        ...


def bellman_target(batch: Batch, next_values: Values, following: Target) -> Float[Array, " B"]:
    """R + discount * (min over critics + entropy bonus), without gradient; a time limit bootstraps."""
    soft = next_values.min(axis=0) + following.entropy_bonus
    target = batch.rewards + following.discount * (1 - batch.terminated) * soft
    return jax.lax.stop_gradient(target)


def regression(values: Values, target: Float[Array, " B"]) -> Float[Array, ""]:
    """Half the mean squared error, summed over the critics."""
    return 0.5 * jnp.square(values - target).mean(axis=1).sum()


class CrossQ(NamedTuple):
    """Batch-renormalised critics that see this and the next step in one joint pass.

    Source: the CrossQ recipe that SAC-Flow trains from scratch with.
    """

    hidden_size: int
    critics: int = 2

    def init(self, key: PRNGKeyArray, inputs: int) -> CriticState:
        """N critics and their running statistics; no targets."""
        create = jax.vmap(lambda each: _RenormNetwork.create(each, inputs, self.hidden_size))
        networks = create(jax.random.split(key, self.critics))
        sizes = (inputs, self.hidden_size, self.hidden_size)
        moments = [Moments.create(size) for size in sizes]
        stacked = jax.tree.map(lambda leaf: jnp.stack([leaf] * self.critics), moments)
        return CriticState(networks, stacked, ())

    def loss(
        self, networks: PyTree, state: CriticState, batch: Batch, following: Target
    ) -> tuple[Float[Array, ""], tuple[CriticState, Values]]:
        """One pass over 2B rows: the batch's moments couple the two halves, and that is kept."""
        now = jnp.concatenate([batch.observations, batch.actions], axis=-1)
        then = jnp.concatenate([batch.next_observations, following.actions], axis=-1)
        both, moments = jax.vmap(_RenormNetwork.train, in_axes=(0, 0, None))(
            networks, state.moments, jnp.concatenate([now, then])
        )
        values, next_values = jnp.split(both, 2, axis=1)
        loss = regression(values, bellman_target(batch, next_values, following))
        return loss, (state._replace(moments=moments), values)

    def values(self, state: CriticState, inputs: Float[Array, "B I"]) -> Values:
        """Values under the running statistics."""
        infer = jax.vmap(_RenormNetwork.infer, in_axes=(0, 0, None))
        return infer(state.networks, state.moments, inputs)

    def follow(self, state: CriticState) -> CriticState:
        """The same state: there is no target network."""
        return state


class Polyak(NamedTuple):
    """LayerNorm critics with exponentially averaged target networks.

    Unless `raw`, their inputs are standardised by running moments, as batch renorm does for `CrossQ`:
    positions in metres differ by centimetres where it matters.
    """

    hidden_size: int
    critics: int = 2
    target_rate: float = 0.005
    raw: bool = False

    def init(self, key: PRNGKeyArray, inputs: int) -> CriticState:
        """N critics, and targets equal to them."""
        create = jax.vmap(lambda each: _LayerNetwork.create(each, inputs, self.hidden_size))
        networks = create(jax.random.split(key, self.critics))
        return CriticState(networks, Moments.create(inputs), jax.tree.map(jnp.copy, networks))

    def loss(
        self, networks: PyTree, state: CriticState, batch: Batch, following: Target
    ) -> tuple[Float[Array, ""], tuple[CriticState, Values]]:
        """Regression on the targets' values of the next step."""
        now = jnp.concatenate([batch.observations, batch.actions], axis=-1)
        then = jnp.concatenate([batch.next_observations, following.actions], axis=-1)
        state = state._replace(moments=observe(state.moments, now))
        values = self._evaluate(networks, state, now)
        target = bellman_target(batch, self._evaluate(state.target, state, then), following)
        return regression(values, target), (state, values)

    def values(self, state: CriticState, inputs: Float[Array, "B I"]) -> Values:
        """Values of the online critics."""
        return self._evaluate(state.networks, state, inputs)

    def follow(self, state: CriticState) -> CriticState:
        """Targets moved by `target_rate` towards the online critics."""
        return state._replace(target=follow(state.target, state.networks, self.target_rate))

    def _evaluate(self, networks: PyTree, state: CriticState, inputs: Float[Array, "B I"]) -> Values:
        evaluate = jax.vmap(_LayerNetwork.__call__, in_axes=(0, None))
        return evaluate(networks, inputs if self.raw else standardise(state.moments, inputs))


class _RenormNetwork(eqx.Module):
    """BRN -> [dense -> ReLU -> BRN] x 2 -> dense."""

    norms: list[BatchRenorm]
    layers: list[Dense]

    @classmethod
    def create(cls, key: PRNGKeyArray, inputs: int, hidden_size: int) -> "_RenormNetwork":
        keys = jax.random.split(key, 3)
        sizes = [inputs, hidden_size, hidden_size, 1]
        layers = [Dense.create(keys[i], sizes[i], sizes[i + 1]) for i in range(3)]
        return cls([BatchRenorm.create(size) for size in sizes[:3]], layers)

    def infer(self, moments: list[Moments], x: Float[Array, "B I"]) -> Float[Array, " B"]:
        x = self.norms[0].infer(moments[0], x)
        for i in (0, 1):
            x = self.norms[i + 1].infer(moments[i + 1], jax.nn.relu(self.layers[i](x)))
        return self.layers[2](x)[:, 0]

    def train(
        self, moments: list[Moments], x: Float[Array, "B I"]
    ) -> tuple[Float[Array, " B"], list[Moments]]:
        x, first = self.norms[0].train(moments[0], x)
        seen = [first]
        for i in (0, 1):
            x, after = self.norms[i + 1].train(moments[i + 1], jax.nn.relu(self.layers[i](x)))
            seen.append(after)
        return self.layers[2](x)[:, 0], seen


class _LayerNetwork(eqx.Module):
    """[dense -> LayerNorm -> ReLU] x 2 -> dense; the norms' gain and bias are left out."""

    layers: list[Dense]

    @classmethod
    def create(cls, key: PRNGKeyArray, inputs: int, hidden_size: int) -> "_LayerNetwork":
        keys = jax.random.split(key, 3)
        sizes = [inputs, hidden_size, hidden_size, 1]
        return cls([Dense.create(keys[i], sizes[i], sizes[i + 1]) for i in range(3)])

    def __call__(self, x: Float[Array, "B I"]) -> Float[Array, " B"]:
        for layer in self.layers[:2]:
            x = jax.nn.relu(jax.nn.standardize(layer(x), axis=-1))
        return self.layers[2](x)[:, 0]
