"""Behaviour cloning: a flow actor matched to demonstrations, critics warmed up on them, stored as a run."""

from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np
import optax
from jax import numpy as jnp
from jaxtyping import Array, Float

from hcpg import registry
from hcpg.interfaces import Method
from hcpg.loops import checkpoints, learning, replay
from hcpg.loops.demonstrations import Demonstrations
from hcpg.loops.runs import RunFolder
from hcpg.loops.runs_axis import stack, take
from hcpg.loops.sitting import create_folders
from hcpg.loops.streams import Stream, key
from hcpg.networks.batch_renorm import WARMUP_CALLS, Moments
from hcpg.networks.descent import descend
from hcpg.networks.flow import FlowActor, Noise
from hcpg.networks.matching import DEVIATION, bridge, end_points, matching_loss
from hcpg.presets import Settings
from hcpg.report.durable import replace_json
from hcpg.types import Batch

CHUNK = 100
"""Steps per compiled call; what is asked for is rounded up to a multiple of it."""
CHECKED, CANDIDATES = 256, 16
"""Demonstrated observations that the clone is asked at in the end, and proposals at each."""
FACTS = "cloning.json"


class NotClonableError(ValueError):
    """A method whose actor is no flow; the message says what to do."""


@dataclass(frozen=True)
class Recipe:
    """How a clone is made; the same for every method that starts from it."""

    steps: int = 5000
    """Of flow matching."""
    batch_size: int = 128
    learning_rate: float = 3e-3
    """At the start; it falls to nothing along a cosine."""
    deviation: float = DEVIATION
    """Of the noise of every flow step, before tanh."""
    critic_updates: int = 2000
    """Of the critics alone, on the demonstrations."""


class Progress(NamedTuple):
    """What cloning changes."""

    actor: FlowActor
    moments: Any
    optimizer: Any


def clone(settings: Settings, shown: Demonstrations, recipe: Recipe, seed: int, root: Path) -> RunFolder:
    """A finished run folder under `root`, whose checkpoint at step 0 holds the clone.

    Raises:
        NotClonableError: the method's actor is no flow.
    """
    task = registry.task(settings.task)
    method = registry.method(settings.method).METHOD(settings.learner, registry.suite(task.suite).spec(task))
    state = learning.initial(method)(key(seed, Stream.NETWORKS))
    if not isinstance(getattr(state, "actor", None), FlowActor):
        raise NotClonableError(
            f"the method {settings.method!r} has no flow actor to be cloned; choose another --preset"
        )
    actor, moments, history = matched(state.actor, settings.learner.flow_steps, shown.batch, recipe, seed)
    state = warmed_up(method, state._replace(actor=actor, actor_moments=moments), shown.batch, recipe, seed)
    found = {**history, **_checked(method, state, shown.batch, seed)}
    [folder] = create_folders(settings, [seed], root)
    checkpoints.save(folder.checkpoints, 0, {"state": state}, {"demonstrations": shown.digest})
    facts = {"demonstrations": {"path": str(shown.path), "sha256": shown.digest}, "recipe": asdict(recipe)}
    replace_json(folder.path / FACTS, {**facts, "found": found})
    folder.set_status("finished", step=0)
    return folder


def matched(
    actor: FlowActor, flow_steps: int, shown: Batch, recipe: Recipe, seed: int
) -> tuple[FlowActor, Any, dict[str, float]]:
    """The actor after cloning, its running moments, and the losses of the last steps."""
    ends = np.asarray(end_points(jnp.asarray(shown.actions)))
    adam = optax.adam(optax.cosine_decay_schedule(recipe.learning_rate, recipe.steps))
    root = key(seed, Stream.CLONING)

    def step(progress: Progress, batch: tuple[Array, Array, Array]) -> tuple[Progress, dict[str, Array]]:
        number, observations, targets = batch
        noise = Noise.draw(jax.random.fold_in(root, number), targets.shape, flow_steps)
        path = bridge(targets, noise, recipe.deviation)
        slope = jax.grad(matching_loss, has_aux=True)
        gradient, (moments, metrics) = slope(
            progress.actor, progress.moments, observations, path, recipe.deviation
        )
        followed = progress.actor.cloning_part(gradient)
        actor, optimizer = descend(adam, followed, progress.optimizer, progress.actor)
        return Progress(actor, moments, optimizer), metrics

    @partial(jax.jit, donate_argnums=0)
    def advance(progress: Progress, batches: tuple[Array, Array, Array]) -> tuple[Progress, dict[str, Array]]:
        progress, history = jax.lax.scan(step, progress, batches)
        return progress, jax.tree.map(jnp.mean, history)

    fresh = jax.tree.map(jnp.copy, actor)  # the compiled steps consume what they are given
    progress, metrics = Progress(fresh, _settled(fresh.moments()), adam.init(fresh)), {}
    for first in range(0, recipe.steps, CHUNK):
        # Drawn out here, so that one compiled program serves any number of demonstrations.
        random = np.random.default_rng([seed, Stream.CLONING, first])
        rows = random.integers(len(ends), size=(CHUNK, recipe.batch_size))
        progress, metrics = advance(
            progress, (first + np.arange(CHUNK), shown.observations[rows], ends[rows])
        )
    return progress.actor, progress.moments, {name: float(value) for name, value in metrics.items()}


def _settled(moments: Any) -> Any:
    """The moments with batch renorm's correction on from the start: what learns is then what acts.

    Before it, a step is normalised by its own batch while learning and by the moments of all steps while
    acting; one network cannot match both.
    """
    return jax.tree.map(
        lambda each: each._replace(calls=jnp.full_like(each.calls, WARMUP_CALLS)),
        moments,
        is_leaf=lambda node: isinstance(node, Moments),
    )


def warmed_up(method: Any, state: Any, shown: Batch, recipe: Recipe, seed: int) -> Any:
    """The state after learning values from the demonstrations; the actor and the temperature stay."""
    never = replace(method, config=replace(method.config, policy_delay=np.iinfo(np.int32).max))
    rows = len(shown.rewards)
    part = {name: np.asarray(values) for name, values in shown._asdict().items()}
    ring = replay.refill(replay.create(1, rows, method.spec), [part], rows)
    learn = learning.compiled(never, type(state), 1, CHUNK, recipe.batch_size)
    keys = [key(seed, stream)[None] for stream in (Stream.REPLAY, Stream.LEARNING)]
    states = stack([state])
    for _ in range(0, recipe.critic_updates, CHUNK):
        states, _, _ = learn(states, ring, *keys)
    return take(states, 0)._replace(updates=jnp.zeros((), jnp.int32))


def _checked(method: Method, state: Any, shown: Batch, seed: int) -> dict[str, float]:
    """How far the clone, acting, is from what was shown, and from itself; in units of the action."""
    places = np.linspace(0, len(shown.rewards) - 1, CHECKED).round().astype(int)
    keys = jax.random.split(jax.random.fold_in(key(seed, Stream.CLONING), np.iinfo(np.int32).max), CHECKED)

    @jax.jit
    def ask(state: Any, observations: Array) -> Float[Array, "N K A"]:
        return jax.vmap(lambda each, own: method.propose(state, each, own, CANDIDATES))(observations, keys)

    proposals = np.asarray(ask(state, shown.observations[places]))
    error = proposals.mean(axis=1) - shown.actions[places]
    return {
        "mean_proposal_error": float(np.sqrt(np.square(error).sum(axis=-1).mean())),
        "proposal_deviation": float(np.sqrt(proposals.var(axis=1).sum(axis=-1).mean())),
    }
