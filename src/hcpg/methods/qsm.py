"""QSM: a diffusion actor whose denoiser is matched to the critics' action gradient."""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import jax
import optax
from jax import numpy as jnp
from jaxtyping import Array, Float, Int, PRNGKeyArray, PyTree

from hcpg.interfaces import Metrics
from hcpg.networks.critics import CriticState, Target
from hcpg.networks.descent import descend, rest
from hcpg.networks.diffusion import XAVIER_UNIFORM, Chain, Denoiser
from hcpg.networks.maximum_entropy import improve_critics, pessimistic_values
from hcpg.networks.mlp import MLP, ensemble
from hcpg.networks.plain_critics import Plain
from hcpg.types import Batch, Sampling, Spec


@dataclass(frozen=True)
class Config:
    """Settings of QSM; the defaults are the published configuration."""

    diffusion_steps: int = 5
    """Reverse steps from noise to action."""
    gradient_scale: float = 50.0
    """Factor on the critics' action gradient in the denoiser's target; the higher, the more the samples
    sit at the bounds. The method's authors suggest 120 for hard tasks."""
    smoothing: float = 0.1
    """Deviation of the noise added to behaviour and to the target's next actions, none at evaluation."""
    actor_hidden_size: int = 512
    """Width of the denoiser's two hidden layers."""
    critic_hidden_size: int = 512
    """Width of the critics' two hidden layers."""
    discount: float = 0.99
    """Discount per environment step, in [0, 1]."""
    actor_learning_rate: float = 3e-4
    """Adam's step size for the denoiser at the start."""
    decay_updates: int = 2_000_000
    """Updates over which the actor's step size falls to zero, along a cosine."""
    critic_learning_rate: float = 3e-4
    """Adam's step size for the critics; it does not see that the loss is half the published one."""
    target_rate: float = 0.005
    """Share of the online critics mixed into their targets at each update."""


class State(NamedTuple):
    """Everything that learning changes."""

    actor: Denoiser
    critic: CriticState
    actor_optimizer: PyTree
    critic_optimizer: PyTree
    updates: Int[Array, ""]


@dataclass(frozen=True)
class QSM:
    """Q-score matching, bound to its settings and to one task's sizes.

    It has no entropy term, no gradient clipping and no norm control: where its numbers grow without
    bound they become non-finite, and the trainer ends the run as diverged.

    Source: Q-score matching (Psenka et al., 2024); constants and updates of its published code.
    """

    config: Config
    spec: Spec
    sampling: ClassVar[Sampling] = Sampling()

    @property
    def critics(self) -> Plain:
        """Two plain critics whose targets follow them."""
        size = self.config.critic_hidden_size
        return Plain((size, size), target_rate=self.config.target_rate)

    def init(self, key: PRNGKeyArray) -> State:
        """Fresh networks and optimizers; targets equal to the critics."""
        config, sizes = self.config, (self.spec.observation_size, self.spec.action_size)
        of_actor, of_critic = jax.random.split(key)
        actor = Denoiser.create(of_actor, sizes, config.actor_hidden_size, config.diffusion_steps)
        widths = (sum(sizes), *self.critics.hidden_sizes, 1)
        networks = ensemble(
            lambda each: MLP.create(each, widths, initializer=XAVIER_UNIFORM), of_critic, self.critics.critics
        )
        return State(
            actor,
            CriticState(networks, (), jax.tree.map(jnp.copy, networks)),
            rest(self._actor_adam, actor),
            rest(self._critic_adam, networks),
            jnp.zeros((), jnp.int32),
        )

    def propose(
        self, state: State, observation: Float[Array, " O"], key: PRNGKeyArray, count: int
    ) -> Float[Array, "K A"]:
        """`count` independent samples of the behaviour: of the denoiser, smoothed."""
        noise = self._noise(key, count)
        return self._smooth(state.actor.sample(observation[None], noise[:-1]), noise[-1])

    def act(self, state: State, observation: Float[Array, " O"], key: PRNGKeyArray) -> Float[Array, " A"]:
        """One sample of the denoiser, not smoothed: evaluation is stochastic but less so than behaviour."""
        return state.actor.sample(observation[None], self._noise(key, 1)[:-1])[0]

    def value(
        self, state: State, observation: Float[Array, " O"], actions: Float[Array, "K A"]
    ) -> Float[Array, " K"]:
        """The smaller of the two online critics' values."""
        return pessimistic_values(self.critics, state.critic, observation, actions)

    def update(self, state: State, batch: Batch, key: PRNGKeyArray) -> tuple[State, Metrics]:
        """Improve the critics, move their targets, then improve the actor by the new critics.

        The measures of instability among the metrics: `target_gradient_max`, the largest entry of the
        denoiser's target in size, |gradient_scale * dQ/da|; `saturated`, the share of the denoiser's
        sampled action entries that are at a bound (0.67 for a denoiser that predicts 0 in five steps);
        `outside`, the share of entries of the noisy actions beyond [-1, 1], where no critic was fitted.
        """
        of_critic, of_actor = jax.random.split(key)
        state, of_values = self._improve_critics(state, batch, of_critic)
        state, of_scores = self._improve_actor(state, batch, of_actor)
        return state._replace(updates=state.updates + 1), {**of_values, **of_scores}

    def _improve_critics(
        self, state: State, batch: Batch, key: PRNGKeyArray
    ) -> tuple[State, dict[str, Array]]:
        noise = self._noise(key, len(batch.rewards))
        sampled = state.actor.sample(batch.next_observations, noise[:-1])
        no_bonus = jnp.zeros_like(batch.rewards)
        following = Target(self._smooth(sampled, noise[-1]), no_bonus, self.config.discount)
        critic, optimizer, metrics = improve_critics(
            self.critics, state.critic, batch, following, self._critic_adam, state.critic_optimizer
        )
        state = state._replace(critic=critic, critic_optimizer=optimizer)
        return state, {**metrics, "saturated": (jnp.abs(sampled) == 1).mean()}

    def _improve_actor(self, state: State, batch: Batch, key: PRNGKeyArray) -> tuple[State, dict[str, Array]]:
        of_times, of_noise = jax.random.split(key)
        times = jax.random.randint(of_times, batch.rewards.shape, 0, self.config.diffusion_steps)
        noise = jax.random.normal(of_noise, batch.actions.shape)
        noisy = Chain.of(self.config.diffusion_steps).diffuse(batch.actions, noise, times)
        scores = self.config.gradient_scale * self._action_gradient(state, batch.observations, noisy)
        loss, gradient = jax.value_and_grad(score_loss)(state.actor, batch.observations, noisy, times, scores)
        actor, optimizer = descend(self._actor_adam, gradient, state.actor_optimizer, state.actor)
        return state._replace(actor=actor, actor_optimizer=optimizer), {
            "actor_loss": loss,
            "actor_gradient": optax.tree.norm(gradient),
            "target_gradient_max": jnp.abs(scores).max(),
            "outside": (jnp.abs(noisy) > 1).mean(),
        }

    def _action_gradient(
        self, state: State, observations: Float[Array, "B O"], actions: Float[Array, "B A"]
    ) -> Float[Array, "B A"]:
        """dQ/da of each row, averaged over the online critics."""

        def total(at: Float[Array, "B A"]) -> Float[Array, ""]:
            inputs = jnp.concatenate([observations, at], axis=-1)
            return self.critics.values(state.critic, inputs).mean(axis=0).sum()

        return jax.grad(total)(actions)

    def _noise(self, key: PRNGKeyArray, rows: int) -> Float[Array, "draws rows A"]:
        """For the chain of each sample, then for its smoothing."""
        return jax.random.normal(key, (self.config.diffusion_steps + 1, rows, self.spec.action_size))

    def _smooth(self, actions: Float[Array, "B A"], noise: Float[Array, "B A"]) -> Float[Array, "B A"]:
        return jnp.clip(actions + self.config.smoothing * noise, -1, 1)

    @property
    def _actor_adam(self) -> optax.GradientTransformation:
        config = self.config
        return optax.adam(optax.cosine_decay_schedule(config.actor_learning_rate, config.decay_updates))

    @property
    def _critic_adam(self) -> optax.GradientTransformation:
        return optax.adam(self.config.critic_learning_rate)


def score_loss(
    actor: Denoiser,
    observations: Float[Array, "B O"],
    noisy: Float[Array, "B A"],
    times: Int[Array, " B"],
    scores: Float[Array, "B A"],
) -> Float[Array, ""]:
    """Mean over rows and entries of (prediction + score)^2: the noise itself is not a target.

    The prediction becomes the negative score, so that a reverse step, which takes it out, climbs Q.

    Source: Q-score matching (Psenka et al., 2024), the actor's objective.
    """
    return jnp.square(actor.predict(observations, noisy, times) + scores).mean()


METHOD = QSM
