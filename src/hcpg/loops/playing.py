"""Watch a trained run: episodes from the evaluation's start states, picture by picture."""

import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import jax
import numpy as np

from hcpg import registry
from hcpg.loops import acting
from hcpg.loops.evaluation import BARE
from hcpg.loops.pool import Pool
from hcpg.loops.streams import EVALUATION_SEED, Stream, key
from hcpg.loops.trained import Trained
from hcpg.report.video import write_video
from hcpg.types import UInt8

FRAMES_PER_S = 25
MOST_FRAMES = 250
"""Pictures of a full episode, about; of a longer one, steps are left out."""
HOLD_FRAMES = 20
"""Pictures shown after the first success."""


class Played(NamedTuple):
    """What a video shows."""

    file: Path
    successes: list[bool]
    """By episode."""


def play(trained: Trained, episodes: int, file: Path | None = None) -> Played:
    """A video of `episodes` episodes, by default in the run's `videos/`.

    An episode ends shortly after its first success, or at its time limit.

    Raises:
        WorkerError: the simulator cannot draw here; the message says what is missing.
        MissingExtraError: the video writer is not installed.
    """
    if file is None:
        file = trained.folder.videos / f"step_{trained.step:09d}_{trained.name}.mp4"
    policy, successes = _compiled(trained), [False] * episodes

    def frames() -> Iterator[UInt8[np.ndarray, "H W 3"]]:
        for start in range(episodes):
            yield from _episode(trained, policy, pool, start, successes)

    with Pool(trained.settings.task, [EVALUATION_SEED], workers=1) as pool, warnings.catch_warnings():
        # The video writer starts ffmpeg by a fork that becomes ffmpeg at once: JAX's threads do not matter.
        warnings.filterwarnings("ignore", r"os\.fork\(\) was called", RuntimeWarning)
        return Played(write_video(frames(), file, FRAMES_PER_S), successes)


def _compiled(trained: Trained) -> Callable[..., acting.Chosen]:
    if trained.name == BARE:
        policy = acting.bare(trained.method)
    else:
        selector = trained.settings.evaluation_selector
        policy = acting.guided(trained.method, selector, trained.read_scene)
    return acting.compiled(policy, type(trained.states), 1)


def _episode(
    trained: Trained, policy: Callable[..., acting.Chosen], pool: Pool, start: int, successes: list[bool]
) -> Iterator[UInt8[np.ndarray, "H W 3"]]:
    """Pictures of the episode from `start`; notes its success in `successes[start]`."""
    horizon = registry.task(trained.settings.task).horizon
    root = jax.random.fold_in(key(trained.seed, Stream.EVALUATION), start)
    keys, lucks = (each[None] for each in jax.random.split(root))
    stride, last = max(1, horizon // MOST_FRAMES), horizon
    observations = pool.reset(np.asarray([start]))
    yield pool.render(0)
    for tick in range(horizon):
        actions = np.asarray(policy(trained.states, observations[None], keys, lucks, tick).actions)[0]
        pool.send(np.asarray(actions, np.float32), np.asarray([start]))
        arrival = pool.receive()
        observations = arrival.observations
        if arrival.success[0] and not successes[start]:
            successes[start], last = True, tick + HOLD_FRAMES * stride
        if arrival.terminated[0] or arrival.truncated[0] or tick >= last:
            return  # the next episode's first picture is not this one's last
        if (tick + 1) % stride == 0:
            yield pool.render(0)
