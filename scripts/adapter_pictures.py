"""What an adapter sees in one episode, as a picture: from above, from the side, and over the steps."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from hcpg.interfaces import Environment, ReadScene
from hcpg.types import Float, Scene

GATE_RADIUS_M = 0.08
EVERY = 2
"""Steps from one pair of arrows to the next."""
ARROW_M = 0.03
APPROACH, TASK, OBJECT, GOAL = "#0072B2", "#D55E00", "#333333", "#009E73"
VIEWS = (("from above", 0, 1), ("from the side", 0, 2))


def draw(
    environment: Environment,
    act: Callable[[Float[np.ndarray, " O"]], Float[np.ndarray, " A"]],
    read_scene: ReadScene,
    steps: int,
    file: Path,
) -> Path:
    """Write the picture of the episode from start state 0, and give back its file.

    The tool's track is blue before contact and orange after it; so are the arrows, towards what counts then.
    The direction that does not count yet, or no more, is drawn thin.
    """
    scenes, succeeded = _record(environment, act, read_scene, steps)
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, panels = plt.subplots(1, 3, figsize=(14, 4.6), layout="constrained")
    for panel, (title, across, up) in zip(panels, VIEWS, strict=False):
        _view(panel, scenes, across, up)
        panel.set_title(title)
    _distances(panels[2], scenes, succeeded)
    tracks, lengths = (panel.get_legend_handles_labels() for panel in (panels[0], panels[2]))
    handles, labels = (one + other for one, other in zip(tracks, lengths, strict=True))
    figure.legend(handles, labels, loc="outside lower center", ncols=5, frameon=False)
    file.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(file, dpi=110)
    plt.close(figure)
    return file


def _record(
    environment: Environment, act: Callable[..., Any], read_scene: ReadScene, steps: int
) -> tuple[Scene, list[bool]]:
    observation, scenes, succeeded = environment.reset(0), [], []
    for _ in range(steps):
        scenes.append(read_scene(observation))
        observation, _, _, success = environment.step(act(observation))
        succeeded.append(success)
    columns = [np.stack([scene[field] for scene in scenes]) for field in range(5)]
    near = np.linalg.norm(columns[3], axis=-1) < GATE_RADIUS_M
    gate = near if scenes[0].contact is None else np.stack([scene.contact for scene in scenes]) > 0.5
    return Scene(*columns, contact=gate), succeeded


def _view(panel: Any, scenes: Scene, across: int, up: int) -> None:
    gate = np.asarray(scenes.contact, bool)
    panel.plot(scenes.object[:, across], scenes.object[:, up], "-", color=OBJECT, lw=1.5, label="object")
    panel.plot(*scenes.object[0, [across, up]], "s", color=OBJECT, ms=8, mfc="none")
    panel.plot(*scenes.goal[0, [across, up]], "*", color=GOAL, ms=14, label="goal")
    for after, color, label in ((False, APPROACH, "before contact"), (True, TASK, "after contact")):
        chosen = scenes.tool[gate == after]
        panel.plot(chosen[:, across], chosen[:, up], ".", color=color, label=f"tool {label}")
    for name, color, counts, start in (
        ("approach", APPROACH, ~gate, scenes.tool),
        ("task", TASK, gate, scenes.object),
    ):
        look = {"color": color, "label": f"{name} direction"}
        _arrows(panel, start, getattr(scenes, name), counts, (across, up), look)
    panel.set_aspect("equal", adjustable="datalim")
    panel.set_xlabel(f"{'xyz'[across]}, m")
    panel.set_ylabel(f"{'xyz'[up]}, m")


def _arrows(
    panel: Any, starts: Any, vectors: Any, counts: Any, axes: tuple[int, int], look: dict[str, str]
) -> None:
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    scaled = (ARROW_M * vectors / np.maximum(lengths, 1e-6))[:, axes]
    for active, width in ((True, 0.006), (False, 0.002)):
        rows = np.flatnonzero(counts == active)[::EVERY]
        panel.quiver(
            *starts[rows][:, axes].T,
            *scaled[rows].T,
            color=look["color"],
            angles="xy",
            scale_units="xy",
            scale=1,
            width=width,
            alpha=1.0 if active else 0.5,
            label=look["label"] if active else None,
        )


def _distances(panel: Any, scenes: Scene, succeeded: list[bool]) -> None:
    steps = np.arange(len(succeeded))
    panel.plot(steps, np.linalg.norm(scenes.approach, axis=-1), color=APPROACH, label="approach vector")
    panel.plot(steps, np.linalg.norm(scenes.task, axis=-1), color=TASK, label="task vector")
    gate, top = np.asarray(scenes.contact, float), panel.get_ylim()[1]
    panel.fill_between(steps, gate * top, color=TASK, alpha=0.15, step="mid", label="gate open")
    panel.fill_between(
        steps, np.asarray(succeeded) * top / 25, color=GOAL, alpha=0.8, step="mid", label="success"
    )
    panel.axhline(GATE_RADIUS_M, color="0.5", lw=0.8, ls=":")
    panel.set_xlabel("step")
    panel.set_ylabel("length, m (dotted: the distance gate)")
    panel.set_title("over the episode")
