"""One root seed -> independent random streams; a draw depends on its counters alone.

No generator carries state from draw to draw, so a resumed run needs nothing but its step count.
"""

from enum import IntEnum
from functools import lru_cache

import jax
import numpy as np
from jaxtyping import PRNGKeyArray

from hcpg.types import Int

EVALUATION_SEED = 1_000_003
"""Names the evaluation's set of start states: the same for every method, apart from training's."""


class Stream(IntEnum):
    """What randomness is for; adding a use never moves the others."""

    NETWORKS = 0
    WARMUP = 1
    ACTOR = 2
    SELECTOR = 3
    REPLAY = 4
    LEARNING = 5
    STARTS = 6
    EVALUATION = 7
    CLONING = 8


def key(seed: int, stream: Stream) -> PRNGKeyArray:
    """The root of one stream of one run."""
    return jax.random.fold_in(jax.random.key(seed), stream)


def start_states(seed: int, episodes: Int[np.ndarray, " E"]) -> Int[np.ndarray, " E"]:
    """The start state of each environment's episode of the given number."""
    return np.asarray([_start_state(seed, index, int(number)) for index, number in enumerate(episodes)])


@lru_cache(maxsize=10_000)  # asked at every step, though it changes once an episode
def _start_state(seed: int, environment: int, episode: int) -> int:
    return int(np.random.default_rng([seed, Stream.STARTS, environment, episode]).integers(2**31))
