"""What the gate does to gradients: SAC-Flow with the gated and with the plain field, on the same data.

Both learn point/reach from transitions under uniform actions. Every hundred updates the loss's gradient by
each sample x_0 ... x_M is measured, in units of that by x_M: what one flow makes of a gradient on its way
back. Writes gate_gradients.png, numbers.json and README.md into a folder.
"""

import argparse
import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jax
import numpy as np
from jax import numpy as jnp

from hcpg import registry
from hcpg.methods.sac_flow import Config, SACFlow, State, sample_slopes
from hcpg.networks.flow import Noise
from hcpg.networks.maximum_entropy import pessimistic_values
from hcpg.types import Batch

if TYPE_CHECKING:
    from matplotlib.axes import Axes

TASK, TRANSITIONS, ROWS, CHUNK = "point/reach", 8000, 128, 100
FIELDS = {"gated": "#0072B2", "plain": "#E69F00"}
FLOW_STEPS = (4, 16)
WHEN = {"first": slice(5), "last": slice(-5, None)}


def transitions() -> Batch:
    """What uniform actions earn in the task, from as many start states as it takes."""
    task = registry.task(TASK)
    environment = registry.suite(task.suite).make(task, seed=0)
    random, rows = np.random.default_rng(0), []
    for index in range(TRANSITIONS):
        if index % task.horizon == 0:
            observation = environment.reset(index // task.horizon)
        action = random.uniform(-1, 1, registry.suite(task.suite).spec(task).action_size)
        step = environment.step(action.astype(np.float32))
        rows.append((observation, action, step.reward, step.observation, float(step.terminated)))
        observation = step.observation
    return Batch(*(jnp.asarray(np.stack(column), jnp.float32) for column in zip(*rows, strict=True)))


def method(velocity: str, flow_steps: int) -> SACFlow:
    """A small learner; rewards lie in [0, 1], hence the small temperature."""
    config = Config(
        velocity=velocity,
        flow_steps=flow_steps,
        actor_hidden_size=64,
        critic_hidden_size=64,
        actor_learning_rate=1e-3,
        initial_temperature=0.01,
        discount=0.95,
    )
    task = registry.task(TASK)
    return SACFlow(config, registry.suite(task.suite).spec(task))


def gains(learner: SACFlow, state: State, batch: Batch, key: jax.Array) -> jax.Array:
    """[M + 1]: the loss's gradient by x_0 ... x_M, over that by x_M."""
    noise = Noise.draw(key, batch.actions.shape, learner.config.flow_steps)

    def loss(nudges: jax.Array) -> jax.Array:
        path, _ = state.actor.train(state.actor_moments, batch.observations, noise, nudges)
        values = pessimistic_values(learner.critics, state.critic, batch.observations, path.actions)
        return (jnp.exp(state.log_temperature) * path.log_prob - values).mean()

    nudges = jnp.zeros((learner.config.flow_steps + 1, *batch.actions.shape))
    slopes = sample_slopes(jax.grad(loss)(nudges))
    return slopes / slopes[-1]


def measured(learner: SACFlow, data: Batch, seeds: list[int], updates: int) -> dict[str, Any]:
    """Gains [seeds, measurements, M + 1] and the actor's gradient norm [seeds, measurements]."""

    def sampled(key: jax.Array) -> Batch:
        rows = jax.random.randint(key, (ROWS,), 0, TRANSITIONS)
        return jax.tree.map(lambda column: column[rows], data)

    def update(state: State, key: jax.Array) -> tuple[State, jax.Array]:
        of_batch, of_update = jax.random.split(key)
        state, metrics = learner.update(state, sampled(of_batch), of_update)
        return state, metrics["actor_gradient"]

    def chunk(state: State, key: jax.Array) -> tuple[State, tuple[jax.Array, jax.Array]]:
        of_updates, of_batch, of_noise = jax.random.split(key, 3)
        state, norms = jax.lax.scan(update, state, jax.random.split(of_updates, CHUNK))
        return state, (gains(learner, state, sampled(of_batch), of_noise), jnp.nanmean(norms))

    @jax.jit
    def run(seed: jax.Array) -> tuple[jax.Array, jax.Array]:
        of_init, of_chunks = jax.random.split(jax.random.key(seed))
        keys = jax.random.split(of_chunks, updates // CHUNK)
        return jax.lax.scan(chunk, learner.init(of_init), keys)[1]

    gain, norm = (np.stack(each) for each in zip(*(run(seed) for seed in seeds), strict=True))
    digits = {"gain": gain, "actor_gradient": norm}
    return {name: np.float64(each).round(4).tolist() for name, each in digits.items()}


def draw(results: dict[str, dict[str, Any]], path: Path) -> None:
    """One row per number of flow steps; thick: mean over seeds, band: smallest to largest seed."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 6.4), layout="constrained")
    panels = figure.subplots(len(FLOW_STEPS), 3, squeeze=False)
    for row, steps in zip(panels, FLOW_STEPS, strict=True):
        for velocity, color in FIELDS.items():
            result = results[f"{velocity} {steps}"]
            gain, norm = np.array(result["gain"]), np.array(result["actor_gradient"])
            updates = CHUNK * np.arange(1, norm.shape[1] + 1)
            band(row[0], np.arange(steps + 1), gain[:, -5:].mean(axis=1), color, velocity)
            band(row[1], updates, gain[:, :, 0], color, velocity)
            band(row[2], updates, norm, color, velocity)
        row[0].set_ylabel(f"M = {steps}\nratio of gradient norms")
        row[0].axhline(1.0, color="0.6", linewidth=0.8)
        row[1].axhline(1.0, color="0.6", linewidth=0.8)
        for panel in row:
            panel.set_ylim(bottom=0)
    titles = ("by x_m / by x_M, last 500 updates", "by x_0 / by x_M", "by the actor's parameters")
    for column, (title, label) in enumerate(zip(titles, ("m", "updates", "updates"), strict=True)):
        panels[0][column].set_title(f"gradient {title}", fontsize=10)
        panels[-1][column].set_xlabel(label)
    panels[0][0].legend(frameon=False)
    figure.savefig(path, dpi=110)


def table(results: dict[str, dict[str, Any]]) -> str:
    """The first and the last five measurements: mean over seeds, smallest and largest seed in brackets."""
    heads = [f"{what}, {when} 500 updates" for what in ("by x_0 / by x_M", "by parameters") for when in WHEN]
    lines = [f"| field, M | {' | '.join(heads)} |", "|---" * (1 + len(heads)) + "|"]
    for name, result in results.items():
        columns = np.array(result["gain"])[:, :, 0], np.array(result["actor_gradient"])
        cells = [each[:, part].mean(axis=1) for each in columns for part in WHEN.values()]
        texts = [f"{cell.mean():.2f} ({cell.min():.2f} to {cell.max():.2f})" for cell in cells]
        lines.append(f"| {name} | {' | '.join(texts)} |")
    return "\n".join(lines) + "\n"


def band(panel: "Axes", x: np.ndarray, y: np.ndarray, color: str, label: str) -> None:
    """The mean over the first axis, and the range of it."""
    panel.plot(x, y.mean(axis=0), color=color, linewidth=2, label=label)
    panel.fill_between(x, y.min(axis=0), y.max(axis=0), color=color, alpha=0.2, linewidth=0)
    panel.grid(color="0.9", linewidth=0.6)
    panel.spines[["top", "right"]].set_visible(False)


def main() -> None:
    """Measure all four, then write numbers, picture and command."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder to write into")
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2])
    parser.add_argument("--updates", type=int, default=2000)
    options = parser.parse_args()
    data, results, settings = transitions(), {}, {}
    for steps in FLOW_STEPS:
        for velocity in FIELDS:
            learner = method(velocity, steps)
            results[f"{velocity} {steps}"] = measured(learner, data, options.seeds, options.updates)
            settings[f"{velocity} {steps}"] = asdict(learner.config)
            print(f"{velocity}, M = {steps}: measured", flush=True)
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "numbers.json").write_text(json.dumps({"settings": settings, "results": results}) + "\n")
    draw(results, options.out / "gate_gradients.png")
    chosen = f"--seeds {' '.join(map(str, options.seeds))} --updates {options.updates}"
    command = f"python scripts/gate_gradients.py --out {options.out} {chosen}"
    text = f"# What the gate does to gradients\n\n```sh\n{command}\n```\n\n{table(results)}"
    (options.out / "README.md").write_text(text)


if __name__ == "__main__":
    main()
