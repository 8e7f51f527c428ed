"""FlowRL: a flow policy that climbs its critics and is anchored to the replay's better actions."""

from dataclasses import dataclass
from typing import ClassVar, Literal, NamedTuple

import jax
import optax
from jax import numpy as jnp
from jaxtyping import Array, Float, Int, PRNGKeyArray, PyTree

from hcpg.interfaces import Metrics
from hcpg.networks.descent import count_update, descend, follow, rest
from hcpg.networks.layer_norm import LayerNormMLP, value_tower
from hcpg.networks.midpoint import MidpointFlow, clamped_normal
from hcpg.networks.mlp import ensemble, evaluate
from hcpg.types import Batch, Sampling, Spec

Weighting = Literal["as_published", "per_sample"]


@dataclass(frozen=True)
class Config:
    """Settings of FlowRL; the defaults are the official code's.

    Its exploration noise has scale 0 there and is left out: training and evaluation draw from one sampler.
    """

    flow_steps: int = 1
    """Midpoint steps from noise to action, two passes of the network each."""
    hidden_size: int = 512
    """Width of every hidden layer."""
    discount: float = 0.99
    """Discount per environment step, in [0, 1]."""
    learning_rate: float = 3e-4
    """Adam's step size for every network."""
    policy_delay: int = 2
    """Critic updates per update of the policy and of the targets."""
    target_rate: float = 0.95
    """Share of the online critics mixed into their targets at each of those: nearly a copy."""
    expectile: float = 0.9
    """Weight of the errors above the buffer value, in (0, 1); those below it weigh the rest."""
    anchor_weight: float = 0.1
    """Weight of the pull to a replayed action whose advantage over the policy's is the batch's average."""
    weighting: Weighting = "as_published"
    """as_published: mean weight times mean error, as the official code computes it.
    per_sample: each error times its own weight, as the publication writes it."""


class Tracked(NamedTuple):
    """Twin critics, and the parameters that follow them."""

    online: PyTree
    target: PyTree


class State(NamedTuple):
    """Everything that learning changes."""

    actor: MidpointFlow
    critic: Tracked
    """Values of the policy."""
    buffer_critic: Tracked
    """Values of the best behaviour in the replay."""
    buffer_value: LayerNormMLP
    """The same behaviour's value of a state; it has no target."""
    actor_optimizer: PyTree
    critic_optimizer: PyTree
    buffer_critic_optimizer: PyTree
    buffer_value_optimizer: PyTree
    updates: Int[Array, ""]


class Draws(NamedTuple):
    """The randomness of one policy loss."""

    start: Float[Array, "B A"]
    """Where the policy's own samples start."""
    anchor_start: Float[Array, "B A"]
    """Where the lines to the replay's actions start."""
    times: Float[Array, " B"]
    """How far along those lines, in [0, 1)."""

    @classmethod
    def draw(cls, key: PRNGKeyArray, shape: tuple[int, int]) -> "Draws":
        """Independent draws for a batch of [B, A]."""
        of_start, of_anchor, of_times = jax.random.split(key, 3)
        times = jax.random.uniform(of_times, shape[:1])
        return cls(clamped_normal(of_start, shape), clamped_normal(of_anchor, shape), times)


@dataclass(frozen=True)
class FlowRL:
    """Flow-based policy for online reinforcement learning, bound to its settings and one task's sizes.

    Source: the official code of "Flow-Based Policy for Online Reinforcement Learning" (FlowRL). Deviation:
    float32 instead of automatic bfloat16, and batches drawn with replacement.
    """

    config: Config
    spec: Spec
    sampling: ClassVar[Sampling] = Sampling(recent_share=0.2, recent_window=2048)

    def init(self, key: PRNGKeyArray) -> State:
        """Fresh networks and optimizers; targets equal to their critics."""
        size, sizes = self.config.hidden_size, (self.spec.observation_size, self.spec.action_size)
        keys = jax.random.split(key, 4)
        actor = MidpointFlow.create(keys[0], sizes, size, self.config.flow_steps)
        critic, buffer_critic = (
            ensemble(lambda each: value_tower(each, sum(sizes), size), of_twins, 2) for of_twins in keys[1:3]
        )
        buffer_value = value_tower(keys[3], sizes[0], size)
        return State(
            actor,
            Tracked(critic, jax.tree.map(jnp.copy, critic)),
            Tracked(buffer_critic, jax.tree.map(jnp.copy, buffer_critic)),
            buffer_value,
            rest(self._adam, actor),
            rest(self._adam, critic),
            rest(self._adam, buffer_critic),
            rest(self._adam, buffer_value),
            jnp.zeros((), jnp.int32),
        )

    def propose(
        self, state: State, observation: Float[Array, " O"], key: PRNGKeyArray, count: int
    ) -> Float[Array, "K A"]:
        """`count` independent samples, in one pass."""
        repeated = jnp.broadcast_to(observation, (count, observation.size))
        return state.actor.actions(repeated, clamped_normal(key, (count, self.spec.action_size)))

    def act(self, state: State, observation: Float[Array, " O"], key: PRNGKeyArray) -> Float[Array, " A"]:
        """One sample: FlowRL has no deterministic action, so evaluation stays stochastic."""
        return self.propose(state, observation, key, 1)[0]

    def value(
        self, state: State, observation: Float[Array, " O"], actions: Float[Array, "K A"]
    ) -> Float[Array, " K"]:
        """The smaller of the two policy critics' values."""
        repeated = jnp.broadcast_to(observation, (actions.shape[0], observation.size))
        return twin_values(state.critic.online, repeated, actions).min(axis=0)

    def update(self, state: State, batch: Batch, key: PRNGKeyArray) -> tuple[State, Metrics]:
        """Improve the critics and the value; every `policy_delay`-th time policy and targets too."""
        of_target, of_policy = jax.random.split(key)
        state, of_critic = self._improve_critic(state, batch, of_target)
        state, replayed, of_buffer = self._improve_buffer_critic(state, batch)
        state, of_value = self._improve_buffer_value(state, batch)
        state, delayed = count_update(
            state,
            self.config.policy_delay,
            lambda state: self._improve_policy(state, batch, replayed, of_policy),
            POLICY_METRICS,
        )
        return state, {**of_critic, **of_buffer, **of_value, **delayed}

    def _improve_critic(
        self, state: State, batch: Batch, key: PRNGKeyArray
    ) -> tuple[State, dict[str, Array]]:
        start = clamped_normal(key, batch.actions.shape)
        actions = state.actor.actions(batch.next_observations, start)
        following = twin_values(state.critic.target, batch.next_observations, actions).min(axis=0)
        loss, values, online, optimizer = self._regress(
            state.critic.online, state.critic_optimizer, batch, following
        )
        state = state._replace(critic=state.critic._replace(online=online), critic_optimizer=optimizer)
        return state, {"critic_loss": loss, "value": values.mean()}

    def _improve_buffer_critic(
        self, state: State, batch: Batch
    ) -> tuple[State, Float[Array, " B"], dict[str, Array]]:
        """Also the smaller values of the replayed actions as they were before the step."""
        following = state.buffer_value(batch.next_observations)[:, 0]
        loss, values, online, optimizer = self._regress(
            state.buffer_critic.online, state.buffer_critic_optimizer, batch, following
        )
        critic = state.buffer_critic._replace(online=online)
        state = state._replace(buffer_critic=critic, buffer_critic_optimizer=optimizer)
        return state, values.min(axis=0), {"buffer_critic_loss": loss, "buffer_value": following.mean()}

    def _regress(
        self, online: PyTree, optimizer: PyTree, batch: Batch, following: Float[Array, " B"]
    ) -> tuple[Array, Array, PyTree, PyTree]:
        """Loss and values before the step, then twin critics and optimizer after it."""
        target = batch.rewards + self.config.discount * (1 - batch.terminated) * following

        def loss(online: PyTree) -> tuple[Array, Array]:
            values = twin_values(online, batch.observations, batch.actions)
            return jnp.square(values - target).mean(axis=1).sum(), values

        (before, values), gradient = jax.value_and_grad(loss, has_aux=True)(online)
        return before, values, *descend(self._adam, gradient, optimizer, online)

    def _improve_buffer_value(self, state: State, batch: Batch) -> tuple[State, dict[str, Array]]:
        judged = twin_values(state.buffer_critic.target, batch.observations, batch.actions).min(axis=0)

        def loss(value: LayerNormMLP) -> Array:
            return expectile_loss(judged - value(batch.observations)[:, 0], self.config.expectile)

        before, gradient = jax.value_and_grad(loss)(state.buffer_value)
        value, optimizer = descend(self._adam, gradient, state.buffer_value_optimizer, state.buffer_value)
        state = state._replace(buffer_value=value, buffer_value_optimizer=optimizer)
        return state, {"buffer_value_loss": before}

    def _improve_policy(
        self, state: State, batch: Batch, replayed: Float[Array, " B"], key: PRNGKeyArray
    ) -> tuple[State, dict[str, Array]]:
        draws = Draws.draw(key, batch.actions.shape)
        (loss, (error, weight)), gradient = jax.value_and_grad(self._actor_loss, has_aux=True)(
            state.actor, state, batch, replayed, draws
        )
        actor, optimizer = descend(self._adam, gradient, state.actor_optimizer, state.actor)
        state = state._replace(
            actor=actor,
            actor_optimizer=optimizer,
            critic=self._followed(state.critic),
            buffer_critic=self._followed(state.buffer_critic),
        )
        numbers = loss, optax.tree.norm(gradient), error, weight
        return state, dict(zip(POLICY_METRICS, numbers, strict=True))

    def _actor_loss(
        self, actor: MidpointFlow, state: State, batch: Batch, replayed: Float[Array, " B"], draws: Draws
    ) -> tuple[Float[Array, ""], tuple[Float[Array, ""], Float[Array, ""]]]:
        actions = actor.actions(batch.observations, draws.start)
        own = twin_values(state.critic.online, batch.observations, actions).min(axis=0)
        errors = actor.matching_errors(batch.observations, batch.actions, draws.anchor_start, draws.times)
        weights = anchor_weights(replayed, own, self.config.anchor_weight)
        loss = anchor(weights, errors, self.config.weighting) - own.mean()
        return loss, (errors.mean(), weights.mean())

    def _followed(self, critic: Tracked) -> Tracked:
        return critic._replace(target=follow(critic.target, critic.online, self.config.target_rate))

    @property
    def _adam(self) -> optax.GradientTransformation:
        return optax.adam(self.config.learning_rate)


def twin_values(
    networks: PyTree, observations: Float[Array, "B O"], actions: Float[Array, "B A"]
) -> Float[Array, "N B"]:
    """Each critic's value of each pair."""
    return evaluate(networks, jnp.concatenate([observations, actions], axis=-1))[..., 0]


def expectile_loss(errors: Float[Array, " B"], expectile: float) -> Float[Array, ""]:
    """Mean square, where errors of at least 0 weigh `expectile` and the others the rest of 1."""
    return (jnp.where(errors < 0, 1 - expectile, expectile) * jnp.square(errors)).mean()


def anchor_weights(
    replayed: Float[Array, " B"], own: Float[Array, " B"], anchor_weight: float
) -> Float[Array, " B"]:
    """Weights in [0.001, 1], without gradient: the more, the better the replayed action than the own."""
    advantage = jax.lax.stop_gradient(jax.nn.relu(replayed - own))
    return jnp.clip(anchor_weight * jnp.exp(advantage - advantage.mean()), 1e-3, 1.0)


def anchor(weights: Float[Array, " B"], errors: Float[Array, " B"], weighting: Weighting) -> Float[Array, ""]:
    """The pull to the replay: mean weight times mean error, or the mean of their products."""
    if weighting == "as_published":
        return weights.mean() * errors.mean()
    return (weights * errors).mean()


POLICY_METRICS = ("actor_loss", "actor_gradient", "anchor_error", "anchor_weight")
METHOD = FlowRL
