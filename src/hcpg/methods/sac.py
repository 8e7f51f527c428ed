"""SAC: maximum-entropy actor-critic whose actor is a tanh-Gaussian."""

from dataclasses import dataclass
from typing import ClassVar, Literal, NamedTuple

import jax
import optax
from jax import numpy as jnp
from jaxtyping import Array, Float, Int, PRNGKeyArray, PyTree

from hcpg.interfaces import Metrics
from hcpg.networks.critics import Critics, CriticState, CrossQ
from hcpg.networks.descent import count_update, descend, rest
from hcpg.networks.gaussian import GaussianActor
from hcpg.networks.maximum_entropy import (
    improve_critics,
    improve_temperature,
    pessimistic_values,
    soft_target,
)
from hcpg.networks.plain_critics import Plain
from hcpg.types import Batch, Sampling, Spec

HIDDEN_LAYERS = 3


@dataclass(frozen=True)
class Config:
    """Settings of SAC; the defaults are the classical recipe."""

    critic: Literal["plain", "crossq"] = "plain"
    """plain: three hidden layers, target networks. crossq: SAC-Flow's (batch renorm, two hidden layers)."""
    actor_hidden_size: int = 256
    """Width of the actor's three hidden layers."""
    critic_hidden_size: int = 256
    """Width of the critics' hidden layers."""
    discount: float = 0.99
    """Discount per environment step, in [0, 1]."""
    actor_learning_rate: float = 3e-4
    """Adam's step size for the actor."""
    critic_learning_rate: float = 3e-4
    """Adam's step size for the critics."""
    temperature_learning_rate: float = 3e-4
    """Adam's step size for the logarithm of the temperature."""
    momentum: float = 0.9
    """Adam's decay of the first moment (beta 1), for all three."""
    policy_delay: int = 1
    """Critic updates per update of actor and temperature; updates left out are not made up for."""
    initial_temperature: float = 1.0
    """Weight of the entropy at the start."""
    target_entropy: float | None = None
    """Entropy of the action that the temperature steers to, nats; None is minus the action size."""
    target_rate: float = 0.005
    """Share of the online critics mixed into their targets at each update (plain only)."""


class State(NamedTuple):
    """Everything that learning changes."""

    actor: GaussianActor
    critic: CriticState
    log_temperature: Float[Array, ""]
    actor_optimizer: PyTree
    critic_optimizer: PyTree
    temperature_optimizer: PyTree
    updates: Int[Array, ""]


@dataclass(frozen=True)
class SAC:
    """The classical baseline, bound to its settings and to one task's sizes.

    Source: Haarnoja et al. 2018, "Soft Actor-Critic Algorithms and Applications", with the network sizes and
    the bounds of the log-deviation as in ManiSkill's baseline.
    """

    config: Config
    spec: Spec
    sampling: ClassVar[Sampling] = Sampling()

    @property
    def critics(self) -> Critics:
        """The critic recipe of the settings."""
        size, rate = self.config.critic_hidden_size, self.config.target_rate
        plain = Plain((size,) * HIDDEN_LAYERS, target_rate=rate)
        return CrossQ(size) if self.config.critic == "crossq" else plain

    @property
    def target_entropy(self) -> float:
        """What the temperature steers the entropy of the action to, nats."""
        chosen = self.config.target_entropy
        return -float(self.spec.action_size) if chosen is None else chosen

    def init(self, key: PRNGKeyArray) -> State:
        """Fresh networks and optimizers."""
        config, sizes = self.config, (self.spec.observation_size, self.spec.action_size)
        of_actor, of_critic = jax.random.split(key)
        actor = GaussianActor.create(of_actor, sizes, [config.actor_hidden_size] * HIDDEN_LAYERS)
        critic = self.critics.init(of_critic, sum(sizes))
        log_temperature = jnp.log(jnp.asarray(config.initial_temperature))
        return State(
            actor,
            critic,
            log_temperature,
            rest(self._adam(config.actor_learning_rate), actor),
            rest(self._adam(config.critic_learning_rate), critic.networks),
            rest(self._adam(config.temperature_learning_rate), log_temperature),
            jnp.zeros((), jnp.int32),
        )

    def propose(
        self, state: State, observation: Float[Array, " O"], key: PRNGKeyArray, count: int
    ) -> Float[Array, "K A"]:
        """`count` independent samples of the policy."""
        noise = jax.random.normal(key, (count, self.spec.action_size))
        return state.actor(observation).sample(noise).actions

    def act(self, state: State, observation: Float[Array, " O"], key: PRNGKeyArray) -> Float[Array, " A"]:
        """The mean through tanh, whatever the key."""
        return jnp.tanh(state.actor(observation).mean)

    def value(
        self, state: State, observation: Float[Array, " O"], actions: Float[Array, "K A"]
    ) -> Float[Array, " K"]:
        """The smaller of the two critics' values."""
        return pessimistic_values(self.critics, state.critic, observation, actions)

    def update(self, state: State, batch: Batch, key: PRNGKeyArray) -> tuple[State, Metrics]:
        """Improve the critics; every `policy_delay`-th time the actor and the temperature too."""
        of_target, of_actor = jax.random.split(key)
        state, metrics = self._improve_critics(state, batch, of_target)
        state, of_policy = count_update(
            state,
            self.config.policy_delay,
            lambda state: self._improve_policy(state, batch, of_actor),
            POLICY_METRICS,
        )
        return state, {**metrics, **of_policy, "temperature": jnp.exp(state.log_temperature)}

    def _improve_critics(
        self, state: State, batch: Batch, key: PRNGKeyArray
    ) -> tuple[State, dict[str, Array]]:
        noise = jax.random.normal(key, batch.actions.shape)
        sample = state.actor(batch.next_observations).sample(noise)
        following = soft_target(sample.actions, sample.log_prob, state.log_temperature, self.config.discount)
        adam = self._adam(self.config.critic_learning_rate)
        critic, optimizer, metrics = improve_critics(
            self.critics, state.critic, batch, following, adam, state.critic_optimizer
        )
        return state._replace(critic=critic, critic_optimizer=optimizer), metrics

    def _improve_policy(
        self, state: State, batch: Batch, key: PRNGKeyArray
    ) -> tuple[State, dict[str, Array]]:
        noise = jax.random.normal(key, batch.actions.shape)
        (loss, entropy), gradient = jax.value_and_grad(self._actor_loss, has_aux=True)(
            state.actor, state, batch.observations, noise
        )
        adam = self._adam(self.config.actor_learning_rate)
        actor, actor_optimizer = descend(adam, gradient, state.actor_optimizer, state.actor)
        adam, surplus = self._adam(self.config.temperature_learning_rate), entropy - self.target_entropy
        log_temperature, temperature_optimizer = improve_temperature(
            state.log_temperature, surplus, adam, state.temperature_optimizer
        )
        state = state._replace(
            actor=actor,
            actor_optimizer=actor_optimizer,
            log_temperature=log_temperature,
            temperature_optimizer=temperature_optimizer,
        )
        norm = optax.tree.norm(gradient)
        return state, {"actor_loss": loss, "entropy": entropy, "actor_gradient": norm}

    def _actor_loss(
        self,
        actor: GaussianActor,
        state: State,
        observations: Float[Array, "B O"],
        noise: Float[Array, "B A"],
    ) -> tuple[Float[Array, ""], Float[Array, ""]]:
        """The loss, which only `actor` gets a gradient of, and the entropy of the action."""
        sample = actor(observations).sample(noise)
        values = pessimistic_values(self.critics, state.critic, observations, sample.actions)
        loss = (jnp.exp(state.log_temperature) * sample.log_prob - values).mean()
        return loss, -sample.log_prob.mean()

    def _adam(self, learning_rate: float) -> optax.GradientTransformation:
        return optax.adam(learning_rate, b1=self.config.momentum)


POLICY_METRICS = ("actor_loss", "entropy", "actor_gradient")
METHOD = SAC
