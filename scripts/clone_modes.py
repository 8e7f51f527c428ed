"""How well a clone keeps two equally frequent ways apart, with its gate kept open and with one that learns.

    python scripts/clone_modes.py

Of two numbers the first is -0.6 or 0.6, whatever is seen; the second is half of what is seen. Told is the
share of samples whose first number is within 0.15 of a way, at the recipe's 5000 steps. Two minutes per row.
"""

import jax
import numpy as np
from jax import numpy as jnp

from hcpg.loops import cloning
from hcpg.loops.cloning import Recipe
from hcpg.networks.flow import Noise
from hcpg.networks.gated_actor import GatedActor
from hcpg.types import Batch

STEPS, ROWS, ASKED, WIDTH, WAY, NEAR, DEVIATION = 4, 512, 4000, 256, 0.6, 0.15, 0.05
EXACT_PATHS = 200_000
CASES = ((False, 1e-3), (True, 1e-3), (True, 3e-3))
"""Whether the gate is kept open, and the learning rate."""


class FreeGate(GatedActor):
    """The actor whose gate is cloned, too."""

    def cloning_part(self, gradient: GatedActor) -> GatedActor:
        """All of it."""
        return gradient


def shown() -> Batch:
    """The demonstrations."""
    generator = np.random.default_rng(0)
    seen = generator.uniform(-1, 1, (ROWS, 1)).astype(np.float32)
    first = np.where(generator.uniform(size=(ROWS, 1)) < 0.5, -WAY, WAY)
    actions = np.concatenate([first, 0.5 * seen], axis=1).astype(np.float32)
    nothing = np.zeros(ROWS, np.float32)
    return Batch(seen, actions, nothing, seen, nothing)


def near(first: np.ndarray) -> float:
    """The share of samples at one of the two ways."""
    return float((np.abs(np.abs(first) - WAY) < NEAR).mean())


def cloned(kept: bool, learning_rate: float) -> float:
    """What a clone gives, acting."""
    actor_class = GatedActor if kept else FreeGate
    actor = actor_class.create(jax.random.key(0), (1, 2), WIDTH)
    recipe = Recipe(batch_size=256, learning_rate=learning_rate, deviation=DEVIATION)
    actor, moments, _ = cloning.matched(actor, STEPS, shown(), recipe, seed=0)
    noise = Noise.draw(jax.random.key(5), (ASKED, 2), STEPS)
    return near(np.asarray(actor.infer(moments, jnp.full((ASKED, 1), 0.8), noise).actions)[:, 0])


def exact() -> float:
    """What Euler steps of the exact velocity give: the mean end, given the sample, less the sample."""
    generator, end = np.random.default_rng(0), np.arctanh(WAY)
    sample = generator.normal(size=EXACT_PATHS)
    mean, variance = 0.0, 1.0  # of the sample over the end, before each step
    for step in range(STEPS):
        share = 1.0 / (STEPS - step)
        expected = end * np.tanh(mean * end * sample / variance)
        sample = sample + (expected - sample) * share + DEVIATION * generator.normal(size=EXACT_PATHS)
        mean, variance = mean + (1 - mean) * share, variance * (1 - share) ** 2 + DEVIATION**2
    return near(np.tanh(sample))


def main() -> None:
    """Print the table."""
    print(f"exact velocity: {100 * exact():.0f} %")
    for kept, rate in CASES:
        gate = "kept open" if kept else "learns"
        print(f"gate {gate}, learning rate {rate:g}: {100 * cloned(kept, rate):.0f} %", flush=True)


if __name__ == "__main__":
    main()
