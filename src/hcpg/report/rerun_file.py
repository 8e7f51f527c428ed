"""A rollout as a recording for the Rerun viewer: scene and proposals, video, the selector's numbers."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hcpg.report.extras import require
from hcpg.report.rollouts import Moment, Rollout, Thought
from hcpg.types import Float

if TYPE_CHECKING:
    from rerun import RecordingStream
    from rerun.blueprint import Blueprint

UNIT_M = 0.1
"""Length at which one unit of action is drawn: long enough to be seen, not what the tool moves in a step."""
JPEG_QUALITY = 85
FLUSH_S = 60.0
"""A row by itself takes ten times its size: rows are written together, so long after they were logged."""
TOOL, OBJECT, GOAL, BLEND = (52, 58, 70), (230, 159, 0), (0, 158, 115), (0, 114, 178)
_LEGEND = """Points: tool (dark), object (orange), goal (green), m. Arrows from the tool: the translation of
every proposal, the more opaque and thick the larger its weight, and of the executed action (blue); one unit
of action is drawn {unit_m} m long. The thin arrow is the vector that the score rewards: to the object before
contact, to the goal after it."""


class RerunFile:
    """Writes rollouts into one `.rrd` file, one after the other on the timeline `step`."""

    def __init__(self, path: Path, title: str) -> None:
        """Begin the file; `title` says which run acts.

        Raises:
            MissingExtraError: rerun-sdk is not installed.
        """
        require("rerun", "rerun")
        import rerun

        path.parent.mkdir(parents=True, exist_ok=True)
        batching = rerun.ChunkBatcherConfig(flush_tick=FLUSH_S)
        self._stream: RecordingStream = rerun.RecordingStream("hcpg play", batcher_config=batching)
        self._stream.save(path, default_blueprint=_layout())
        text = f"{title}\n\n{_LEGEND.format(unit_m=UNIT_M)}"
        self._stream.log("about", rerun.TextDocument(text), static=True)
        self._step = 0

    def add(self, moment: Moment, rollout: Rollout) -> None:
        """Write the next step; `rollout` says which episode it belongs to.

        Raises:
            ValueError: no selector acted, so there is nothing to see.
        """
        if moment.thought is None:
            raise ValueError("a step without a selector has no proposals to record")
        self._stream.set_time("step", sequence=self._step)
        self._stream.set_time("tick_of_episode", sequence=moment.tick)
        self._step += 1
        _scene(self._stream, moment.thought)
        _arrows(self._stream, moment, rollout.translation)
        _numbers(self._stream, moment, rollout.start)
        if moment.picture is not None:
            import rerun

            self._stream.log("video", rerun.Image(moment.picture).compress(jpeg_quality=JPEG_QUALITY))

    def close(self) -> None:
        """Finish the file."""
        self._stream.flush()
        self._stream.disconnect()


def _scene(stream: "RecordingStream", thought: Thought) -> None:
    import rerun

    points = {"tool": TOOL, "object": OBJECT, "goal": GOAL}
    for name, color in points.items():
        position = getattr(thought.scene, name)
        stream.log(f"world/{name}", rerun.Points3D([position], colors=[color], radii=0.012, labels=[name]))
    target = (1 - thought.phase) * thought.scene.approach + thought.phase * thought.scene.task
    arrow = rerun.Arrows3D(origins=[thought.scene.tool], vectors=[target], colors=[(*GOAL, 90)], radii=0.002)
    stream.log("world/target", arrow)


def _arrows(stream: "RecordingStream", moment: Moment, translation: tuple[int, int]) -> None:
    """Every proposal, and the action that was executed."""
    import rerun

    thought, moves = moment.thought, slice(*translation)
    assert thought is not None
    tool, weights = thought.scene.tool, thought.weights
    opacity = (60 + 195 * weights / weights.max()).astype(np.uint8)
    proposals = rerun.Arrows3D(
        origins=np.tile(tool, (len(weights), 1)),
        vectors=UNIT_M * thought.proposals[:, moves],
        colors=[(*OBJECT, int(each)) for each in opacity],
        radii=0.001 + 0.004 * weights,
        labels=[f"{weight:.2f}" for weight in weights],
    )
    stream.log("world/proposals", proposals)
    executed = rerun.Arrows3D(
        origins=[tool], vectors=[UNIT_M * moment.action[moves]], colors=[BLEND], radii=0.004
    )
    stream.log("world/action", executed)


def _numbers(stream: "RecordingStream", moment: Moment, start: int) -> None:
    import rerun

    thought = moment.thought
    assert thought is not None
    series: dict[str, Float[np.ndarray, " N"] | float] = {
        "selector/weights": thought.weights,
        "selector/scores": thought.scores,
        "selector/phase": thought.phase,
        "selector/spread": thought.spread,
        "selector/blend_gap": thought.blend_gap,
        "selector/effective_candidates": 1 / float(np.square(thought.weights).sum()),
        "distance_m/approach": float(np.linalg.norm(thought.scene.approach)),
        "distance_m/task": float(np.linalg.norm(thought.scene.task)),
        "episode/reward": moment.reward,
        "episode/success": float(moment.success),
        "episode/start": float(start),
    }
    for name, values in series.items():
        stream.log(name, rerun.Scalars(values))


def _layout() -> "Blueprint":
    """The scene beside the video, the numbers below; `about` at the side."""
    from rerun import blueprint as view

    scene = view.Horizontal(
        view.Spatial3DView(origin="world", name="scene"),
        view.Spatial2DView(origin="video", name="video"),
        view.TextDocumentView(origin="about", name="about"),
        column_shares=[3, 2, 1],
    )
    numbers = view.Horizontal(
        view.TimeSeriesView(origin="selector/weights", name="weights"),
        view.TimeSeriesView(origin="selector/scores", name="scores"),
        view.TimeSeriesView(origin="selector/phase", name="phase: 0 approach, 1 task"),
        view.TimeSeriesView(origin="distance_m", name="distance, m"),
    )
    return view.Blueprint(view.Vertical(scene, numbers, row_shares=[2, 1]), collapse_panels=True)
