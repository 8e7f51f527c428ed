"""SAC-Flow: maximum-entropy actor-critic whose actor is a flow."""

from dataclasses import dataclass
from typing import ClassVar, Literal, NamedTuple

import jax
import optax
from jax import numpy as jnp
from jaxtyping import Array, Float, Int, PRNGKeyArray, PyTree

from hcpg.interfaces import Metrics
from hcpg.networks.critics import Critics, CriticState, CrossQ, Polyak
from hcpg.networks.decoder_actor import DecoderActor
from hcpg.networks.descent import count_update, descend, rest
from hcpg.networks.flow import FlowActor, Noise
from hcpg.networks.gated_actor import GatedActor
from hcpg.networks.matching import DEVIATION, bridge, end_points, matching_loss
from hcpg.networks.maximum_entropy import (
    improve_critics,
    improve_temperature,
    pessimistic_values,
    soft_target,
)
from hcpg.networks.plain_actor import PlainActor
from hcpg.types import Batch, Sampling, Spec


@dataclass(frozen=True)
class Config:
    """Settings of SAC-Flow; the defaults are the official from-scratch recipe."""

    velocity: Literal["gated", "decoder", "plain"] = "gated"
    """gated: Flow-G. decoder: Flow-T. plain: the naive flow, which has no gate."""
    plain_norm: Literal["shared", "per_step"] = "shared"
    """shared: one input norm for all flow steps, as published. per_step: one for each (plain only)."""
    density: Literal["corrected", "as_published"] = "corrected"
    """as_published: the path's density leaves out the deviation of the steps (decoder only)."""
    critic: Literal["crossq", "polyak"] = "crossq"
    """crossq: batch renorm, joint pass, no target network. polyak: LayerNorm, target networks."""
    polyak_inputs: Literal["standardised", "raw"] = "standardised"
    """standardised: by running moments. raw: as they come, as elsewhere (polyak only)."""
    flow_steps: int = 4
    """Euler steps from noise to action."""
    actor_hidden_size: int = 512
    """Width of the gate, the candidate and the deviation network; of the plain field's layers."""
    decoder_hidden_size: int = 96
    """Width of the decoder's token; its feed-forward layers are four times as wide."""
    critic_hidden_size: int = 1024
    """Width of the critics' two hidden layers."""
    discount: float = 0.99
    """Discount per environment step, in [0, 1]."""
    actor_learning_rate: float = 3e-4
    """Adam's step size for the actor."""
    critic_learning_rate: float = 1e-3
    """Adam's step size for the critics."""
    temperature_learning_rate: float = 1e-3
    """Adam's step size for the logarithm of the temperature."""
    momentum: float = 0.5
    """Adam's decay of the first moment (beta 1), for all three."""
    policy_delay: int = 3
    """Critic updates per update of actor and temperature."""
    initial_temperature: float = 0.2
    """Weight of the entropy at the start."""
    target_entropy: float = 0.0
    """Entropy of the path (not of the action) that the temperature steers to, nats."""
    imitation: float = 0.0
    """Weight of flow matching to the batch's actions in the actor's loss; 0 for learning from scratch."""
    target_rate: float = 0.005
    """Share of the online critics mixed into their targets at each update (polyak only)."""

    def __post_init__(self) -> None:
        """Refuse a setting that would change nothing, or what no code published.

        Raises:
            ValueError: `density` is as_published for a field whose published density is right,
                `plain_norm` is set for another field, or `polyak_inputs` for other critics.
        """
        if self.polyak_inputs == "raw" and self.critic != "polyak":
            raise ValueError(
                f"polyak_inputs 'raw' is the critic 'polyak's alone, not that of {self.critic!r}: "
                "choose critic 'polyak', or polyak_inputs 'standardised'"
            )
        if self.density == "as_published" and self.velocity != "decoder":
            raise ValueError(
                f"density 'as_published' is the velocity 'decoder's alone, not that of {self.velocity!r}: "
                "choose velocity 'decoder', or density 'corrected'"
            )
        if self.plain_norm == "per_step" and self.velocity != "plain":
            raise ValueError(
                f"plain_norm 'per_step' is the velocity 'plain's alone, not that of {self.velocity!r}: "
                "choose velocity 'plain', or plain_norm 'shared'"
            )


class State(NamedTuple):
    """Everything that learning changes."""

    actor: FlowActor
    actor_moments: PyTree
    critic: CriticState
    log_temperature: Float[Array, ""]
    actor_optimizer: PyTree
    critic_optimizer: PyTree
    temperature_optimizer: PyTree
    updates: Int[Array, ""]


@dataclass(frozen=True)
class SACFlow:
    """The paper's backbone, bound to its settings and to one task's sizes.

    Source: paper, section III-A; recipe of SAC-Flow trained from scratch.
    """

    config: Config
    spec: Spec
    sampling: ClassVar[Sampling] = Sampling()

    @property
    def critics(self) -> Critics:
        """The critic recipe of the settings."""
        config = self.config
        if config.critic == "crossq":
            return CrossQ(config.critic_hidden_size)
        raw = config.polyak_inputs == "raw"
        return Polyak(config.critic_hidden_size, target_rate=config.target_rate, raw=raw)

    def init(self, key: PRNGKeyArray) -> State:
        """Fresh networks and optimizers."""
        config = self.config
        of_actor, of_critic = jax.random.split(key)
        actor = self._fresh_actor(of_actor)
        critic = self.critics.init(of_critic, sum(self.spec))
        log_temperature = jnp.log(jnp.asarray(config.initial_temperature))
        return State(
            actor,
            actor.moments(),
            critic,
            log_temperature,
            rest(self._adam(config.actor_learning_rate), actor),
            rest(self._adam(config.critic_learning_rate), critic.networks),
            rest(self._adam(config.temperature_learning_rate), log_temperature),
            jnp.zeros((), jnp.int32),
        )

    def _fresh_actor(self, key: PRNGKeyArray) -> FlowActor:
        config, sizes = self.config, (self.spec.observation_size, self.spec.action_size)
        match config.velocity:
            case "gated":
                return GatedActor.create(key, sizes, config.actor_hidden_size)
            case "plain":
                norms = 1 if config.plain_norm == "shared" else config.flow_steps
                return PlainActor.create(key, sizes, config.actor_hidden_size, norms)
            case "decoder":
                size, steps = config.decoder_hidden_size, config.flow_steps
                return DecoderActor.create(key, sizes, size, steps, config.density)

    def propose(
        self, state: State, observation: Float[Array, " O"], key: PRNGKeyArray, count: int
    ) -> Float[Array, "K A"]:
        """`count` independent samples of the noise-perturbed flow, in one pass."""
        noise = Noise.draw(key, (count, self.spec.action_size), self.config.flow_steps)
        return state.actor.infer(state.actor_moments, observation[None], noise).actions

    def act(self, state: State, observation: Float[Array, " O"], key: PRNGKeyArray) -> Float[Array, " A"]:
        """One sample: a flow policy has no deterministic action, so evaluation stays stochastic."""
        return self.propose(state, observation, key, 1)[0]

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
        noise = Noise.draw(key, batch.actions.shape, self.config.flow_steps)
        path = state.actor.infer(state.actor_moments, batch.next_observations, noise)
        following = soft_target(path.actions, path.log_prob, state.log_temperature, self.config.discount)
        adam = self._adam(self.config.critic_learning_rate)
        critic, optimizer, metrics = improve_critics(
            self.critics, state.critic, batch, following, adam, state.critic_optimizer
        )
        return state._replace(critic=critic, critic_optimizer=optimizer), metrics

    def _improve_policy(
        self, state: State, batch: Batch, key: PRNGKeyArray
    ) -> tuple[State, dict[str, Array]]:
        noise = Noise.draw(key, batch.actions.shape, self.config.flow_steps)
        nudges = jnp.zeros((self.config.flow_steps + 1, *batch.actions.shape))
        slopes = jax.value_and_grad(self._actor_loss, argnums=(0, 1), has_aux=True)
        (loss, (entropy, moments)), (gradient, by_samples) = slopes(state.actor, nudges, state, batch, noise)
        adam = self._adam(self.config.actor_learning_rate)
        actor, actor_optimizer = descend(adam, gradient, state.actor_optimizer, state.actor)
        surplus = entropy - self.config.target_entropy
        adam = self._adam(self.config.temperature_learning_rate)
        log_temperature, temperature_optimizer = improve_temperature(
            state.log_temperature, surplus, adam, state.temperature_optimizer
        )
        state = state._replace(
            actor=actor,
            actor_moments=moments,
            actor_optimizer=actor_optimizer,
            log_temperature=log_temperature,
            temperature_optimizer=temperature_optimizer,
        )
        start, end = sample_slopes(by_samples[:: self.config.flow_steps])
        norm = optax.tree.norm(gradient)
        return state, dict(zip(POLICY_METRICS, (loss, entropy, norm, start, end), strict=True))

    def _actor_loss(
        self,
        actor: FlowActor,
        nudges: Float[Array, "M1 B A"],
        state: State,
        batch: Batch,
        noise: Noise,
    ) -> tuple[Float[Array, ""], tuple[Float[Array, ""], PyTree]]:
        path, moments = actor.train(state.actor_moments, batch.observations, noise, nudges)
        values = pessimistic_values(self.critics, state.critic, batch.observations, path.actions)
        loss = (jnp.exp(state.log_temperature) * path.log_prob - values).mean()
        if self.config.imitation > 0:
            loss += self.config.imitation * self._strayed(actor, state.actor_moments, batch, noise)
        return loss, (-path.log_prob.mean(), moments)

    def _strayed(self, actor: FlowActor, moments: PyTree, batch: Batch, noise: Noise) -> Float[Array, ""]:
        """How far the flow is from one that gives the batch's actions: the loss of cloning."""
        path = bridge(end_points(batch.actions), noise, DEVIATION)
        return matching_loss(actor, moments, batch.observations, path, DEVIATION)[0]

    def _adam(self, learning_rate: float) -> optax.GradientTransformation:
        return optax.adam(learning_rate, b1=self.config.momentum)


def sample_slopes(by_samples: Float[Array, "M1 B A"]) -> Float[Array, " M1"]:
    """Length of one row's gradient by its sample at each time, root mean square over the batch.

    `by_samples` is the gradient of the batch's mean loss.
    """
    rows = by_samples.shape[1]
    return jnp.sqrt(rows * jnp.square(by_samples).sum(axis=(1, 2)))


POLICY_METRICS = ("actor_loss", "path_entropy", "actor_gradient", "start_gradient", "end_gradient")
"""The last three: lengths of the loss's gradient by all parameters, by x_0 and by x_M (`sample_slopes`)."""
METHOD = SACFlow
