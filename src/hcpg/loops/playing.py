"""Watch a trained run: episodes from the evaluation's start states, step by step."""

import warnings
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np

from hcpg import registry
from hcpg.loops import acting
from hcpg.loops.evaluation import BARE
from hcpg.loops.pool import Pool
from hcpg.loops.streams import EVALUATION_SEED, Stream, key
from hcpg.loops.trained import Trained
from hcpg.report.rerun_file import RerunFile
from hcpg.report.rollouts import Moment, Rollout, Thought
from hcpg.report.video import write_video
from hcpg.types import Float, Scene, UInt8

FRAMES_PER_S = 25
MOST_FRAMES = 250
"""Pictures of a full episode, about; of a longer one, steps are left out."""
HOLD_FRAMES = 20
"""Pictures shown after the first success."""


class PlayError(ValueError):
    """Something to be shown that this run does not have; the message says what to choose."""


class Played(NamedTuple):
    """What was written, and what it shows."""

    file: Path
    """The video."""
    successes: list[bool]
    """By episode."""
    shown: Rollout
    """The first episode with success, or the first of all."""


def play(trained: Trained, episodes: int, file: Path | None = None, rerun: Path | None = None) -> Played:
    """A video of `episodes` episodes, by default in the run's `videos/`, and a recording if asked for.

    An episode ends shortly after its first success, or at its time limit.

    Args:
        trained: the run and how it acts.
        episodes: how many, from the first start states of the evaluation.
        file: the video, an mp4 file.
        rerun: a recording of the same episodes for the Rerun viewer, an rrd file.

    Raises:
        PlayError: a recording of a run that acts without a selector.
        RenderingError: this machine cannot draw; the message says what is missing.
        MissingExtraError: the video writer or rerun-sdk is not installed.
    """
    if rerun is not None and trained.name == BARE:
        raise PlayError(
            "the bare actor selects nothing, so there is nothing to record. Choose a selector, e.g. "
            "--selector hcpg."
        )
    if file is None:
        file = video_of(trained)
    told = _Told()
    with ExitStack() as stack:
        pool = stack.enter_context(Pool(trained.settings.task, [EVALUATION_SEED], workers=1))
        recording = None if rerun is None else RerunFile(rerun, _title(trained))
        if recording is not None:
            stack.callback(recording.close)
        stack.enter_context(warnings.catch_warnings())
        # The video writer starts ffmpeg by a fork that becomes ffmpeg at once: JAX's threads do not matter.
        warnings.filterwarnings("ignore", r"os\.fork\(\) was called", RuntimeWarning)
        write_video(_pictures(trained, pool, episodes, told, recording), file, FRAMES_PER_S)
    assert told.shown is not None
    return Played(file, told.successes, told.shown)


def video_of(trained: Trained) -> Path:
    """Where the video of the run, acting as chosen, goes if nobody says otherwise."""
    return trained.folder.videos / f"step_{trained.step:09d}_{trained.name}.mp4"


def _title(trained: Trained) -> str:
    settings = trained.settings
    return (
        f"{settings.task}, {settings.preset} seed {trained.seed} at step {trained.step:,}, selector "
        f"{trained.name}, adapter {settings.adapter}"
    )


@dataclass
class _Told:
    """What is known of the episodes so far; pictures take memory, so only one episode is kept."""

    successes: list[bool] = field(default_factory=list)
    shown: Rollout | None = None

    def note(self, rollout: Rollout) -> None:
        success = rollout.success_tick is not None
        if self.shown is None or (success and True not in self.successes):
            self.shown = rollout
        self.successes.append(success)


def _pictures(
    trained: Trained, pool: Pool, episodes: int, told: _Told, recording: RerunFile | None
) -> Iterator[UInt8[np.ndarray, "H W 3"]]:
    """The video's pictures; notes every episode in `told`."""
    policy = _compiled(trained)
    for start in range(episodes):
        rollout = _empty(trained, start)
        for moment in _moments(trained, policy, pool, start):
            rollout.moments.append(moment)
            if recording is not None:
                recording.add(moment, rollout)
            if moment.picture is not None:
                yield moment.picture
        told.note(rollout)


def _empty(trained: Trained, start: int) -> Rollout:
    settings = trained.settings
    return Rollout(
        task=settings.task,
        preset=settings.preset,
        seed=trained.seed,
        step=trained.step,
        selector=trained.name,
        start=start,
        translation=settings.evaluation_selector.translation,
        moments=[],
    )


def _compiled(trained: Trained) -> Callable[..., Any]:
    if trained.name == BARE:
        policy = acting.bare(trained.method)
    else:
        selector = trained.settings.evaluation_selector
        policy = acting.considered(trained.method, selector, trained.read_scene)
    return acting.compiled(policy, type(trained.states), 1)


def _moments(trained: Trained, policy: Callable[..., Any], pool: Pool, start: int) -> Iterator[Moment]:
    """The episode from `start`, until shortly after its first success."""
    horizon = registry.task(trained.settings.task).horizon
    root = jax.random.fold_in(key(trained.seed, Stream.EVALUATION), start)
    keys, lucks = (each[None] for each in jax.random.split(root))
    stride, last, succeeded = max(1, horizon // MOST_FRAMES), horizon, False
    observations = pool.reset(np.asarray([start]))
    for tick in range(horizon):
        picture = pool.render(0) if tick % stride == 0 else None
        found = jax.device_get(policy(trained.states, observations[None], keys, lucks, tick))
        action = np.asarray(found.actions[0, 0], np.float32)
        pool.send(action[None], np.asarray([start]))
        arrival = pool.receive()
        observations, success = arrival.observations, bool(arrival.success[0])
        yield Moment(tick, picture, _thought(found), action, float(arrival.rewards[0]), success)
        if success and not succeeded:
            succeeded, last = True, tick + HOLD_FRAMES * stride
        if arrival.terminated[0] or arrival.truncated[0] or tick >= last:
            return  # the next episode's first picture is not this one's last


def _thought(found: Any) -> Thought | None:
    """What the selector did, of the one run and environment there are; None where none chose."""
    if not isinstance(found, acting.Considered):
        return None
    proposals, scene, diagnostics = jax.tree.map(lambda leaf: leaf[0, 0], tuple(found[1:]))
    points: list[Float[np.ndarray, ...] | None] = list(scene)
    return Thought(
        proposals,
        diagnostics.weights,
        diagnostics.scores,
        Scene(*points),
        float(diagnostics.phase),
        float(diagnostics.spread),
        float(diagnostics.blend_gap),
    )
