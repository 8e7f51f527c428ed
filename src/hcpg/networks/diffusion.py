"""A diffusion actor: noise carried to an action by the reverse steps of a variance-preserving chain."""

from typing import NamedTuple

import equinox as eqx
import jax
from jax import numpy as jnp
from jaxtyping import Array, Float, Int, PRNGKeyArray

from hcpg.networks.dense import Dense
from hcpg.networks.mlp import MLP

BETA_MIN, BETA_MAX = 0.1, 10.0
TIME_FREQUENCIES = 32
FREQUENCY_DEVIATION = 0.2
TIME_SIZE = 128
XAVIER_UNIFORM = jax.nn.initializers.glorot_uniform()


class Chain(NamedTuple):
    """The constants of a chain of T steps; index t belongs to step t + 1."""

    betas: Float[Array, " T"]
    """Variance that a forward step adds."""
    kept: Float[Array, " T"]
    """Share of the action's variance left after steps 0 to t: the product of 1 - beta."""

    @classmethod
    def of(cls, steps: int) -> "Chain":
        """The variance-preserving chain of `steps` steps.

        Source: Q-score matching (Psenka et al., 2024), the "vp" schedule of its code:
        1 - beta_t = exp(-b_min / T - (b_max - b_min) (2t - 1) / (2 T^2)), t = 1..T.
        """
        t = jnp.arange(1, steps + 1)
        logarithms = -BETA_MIN / steps - (BETA_MAX - BETA_MIN) * (2 * t - 1) / (2 * steps**2)
        return cls(-jnp.expm1(logarithms), jnp.exp(jnp.cumsum(logarithms)))

    def diffuse(
        self, actions: Float[Array, "B A"], noise: Float[Array, "B A"], times: Int[Array, " B"]
    ) -> Float[Array, "B A"]:
        """Each action after its own number of forward steps, `times` + 1; it may leave [-1, 1]."""
        kept = self.kept[times][:, None]
        return jnp.sqrt(kept) * actions + jnp.sqrt(1 - kept) * noise

    def denoise(
        self, sample: Float[Array, "*batch A"], predicted: Float[Array, "*batch A"], step: int
    ) -> Float[Array, "*batch A"]:
        """The mean of reverse step `step`, from the noise predicted in `sample`."""
        beta = self.betas[step]
        return (sample - beta / jnp.sqrt(1 - self.kept[step]) * predicted) / jnp.sqrt(1 - beta)


class Clock(eqx.Module):
    """Learnable random Fourier features of the step number, and a small network on them."""

    frequencies: Float[Array, " F"]
    network: MLP

    @classmethod
    def create(cls, key: PRNGKeyArray) -> "Clock":
        """Frequencies of deviation 0.2; one hidden layer."""
        of_frequencies, of_network = jax.random.split(key)
        sizes = (2 * TIME_FREQUENCIES, TIME_SIZE, TIME_SIZE)
        return cls(
            FREQUENCY_DEVIATION * jax.random.normal(of_frequencies, (TIME_FREQUENCIES,)),
            MLP.create(of_network, sizes, mish, XAVIER_UNIFORM),
        )

    def features(self, steps: int) -> Float[Array, "T F"]:
        """Cosines, then sines, of 2 pi times frequency times the integers 0 to `steps` - 1."""
        angles = 2 * jnp.pi * jnp.arange(steps)[:, None] * self.frequencies
        return jnp.concatenate([jnp.cos(angles), jnp.sin(angles)], axis=-1)

    def codes(self, steps: int) -> Float[Array, "T C"]:
        """The code of every step of the chain."""
        return self.network(self.features(steps))


class Denoiser(eqx.Module):
    """Predicts, from (action, observation, step), the noise that a reverse step takes out.

    Observation and step enter the first layer linearly, so their shares of it are computed once per
    chain, not once per step.
    """

    clock: Clock
    first: Dense
    second: Dense
    last: Dense
    steps: int = eqx.field(static=True)

    @classmethod
    def create(cls, key: PRNGKeyArray, sizes: tuple[int, int], hidden_size: int, steps: int) -> "Denoiser":
        """A fresh one for (observation, action) `sizes` and a chain of `steps`."""
        keys = jax.random.split(key, 4)
        inputs = sum(sizes) + TIME_SIZE
        return cls(
            Clock.create(keys[0]),
            Dense.create(keys[1], inputs, hidden_size, XAVIER_UNIFORM),
            Dense.create(keys[2], hidden_size, hidden_size, XAVIER_UNIFORM),
            Dense.create(keys[3], hidden_size, sizes[1], XAVIER_UNIFORM),
            steps,
        )

    def predict(
        self, observations: Float[Array, "B O"], noisy: Float[Array, "B A"], times: Int[Array, " B"]
    ) -> Float[Array, "B A"]:
        """The noise in each action, every row at its own step of the chain."""
        return self._predict(noisy, self._of_observation(observations) + self._of_time()[times])

    def sample(
        self, observations: Float[Array, "*state O"], noise: Float[Array, "T *batch A"]
    ) -> Float[Array, "*batch A"]:
        """Actions in [-1, 1], clipped after every reverse step.

        `noise` is standard normal: the start, then what each step but the last adds.

        Source: Q-score matching (Psenka et al., 2024), the clipped DDPM sampler of its code.
        """
        chain = Chain.of(self.steps)
        of_observation, of_time = self._of_observation(observations), self._of_time()
        sample = noise[0]
        for step in reversed(range(self.steps)):
            predicted = self._predict(sample, of_observation + of_time[step])
            sample = chain.denoise(sample, predicted, step)
            if step > 0:
                sample = sample + jnp.sqrt(chain.betas[step]) * noise[self.steps - step]
            sample = jnp.clip(sample, -1, 1)
        return sample

    def _of_observation(self, observations: Float[Array, "*state O"]) -> Float[Array, "*state H"]:
        kernel = self.first.kernel[self._action_size : -TIME_SIZE]
        return observations @ kernel + self.first.bias

    def _of_time(self) -> Float[Array, "T H"]:
        return self.clock.codes(self.steps) @ self.first.kernel[-TIME_SIZE:]

    def _predict(
        self, sample: Float[Array, "*batch A"], drive: Float[Array, "*state H"]
    ) -> Float[Array, "*batch A"]:
        hidden = mish(sample @ self.first.kernel[: self._action_size] + drive)
        return self.last(mish(self.second(hidden)))

    @property
    def _action_size(self) -> int:
        return self.last.bias.shape[-1]


def mish(x: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
    """`x * tanh(log(1 + exp(x)))`, rewritten so that it takes one exponential and no other function."""
    power = jnp.exp(jnp.minimum(x, 20.0))  # beyond, the factor is 1 in float32
    odds = power * (power + 2)
    return x * (odds / (odds + 2))
