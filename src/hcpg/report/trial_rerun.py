"""A trial as a recording for the Rerun viewer: arm, proposals, phase, limits touched, timing."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hcpg.report.extras import require
from hcpg.report.rerun_file import BLEND, FLUSH_S, GOAL, OBJECT, TOOL, UNIT_M
from hcpg.report.trial_replay import LoggedTick, LoggedTrial
from hcpg.twin.posing import Posing, Shape
from hcpg.twin.scenes import SCENES

if TYPE_CHECKING:
    from rerun import RecordingStream
    from rerun.blueprint import Blueprint

ARM = "world/arm"
_LEGEND = f"""Arm and things are drawn from what was logged (joint angles, width of the fingers, sightings);
nothing is simulated again. Arrows from the TCP: the K proposals, the more opaque and thick the larger their
weight, and what was executed after all limits (blue); one unit of action is drawn {UNIT_M} m long. The box is
the one that no target leaves. Timelines: `tick` (periods since the beginning, skipped ones too), `time`."""


def write_trial(trial: LoggedTrial, path: Path) -> None:
    """Write the recording.

    Raises:
        MissingExtraError: rerun-sdk is not installed.
    """
    require("rerun", "rerun")
    import rerun

    path.parent.mkdir(parents=True, exist_ok=True)
    batching = rerun.ChunkBatcherConfig(flush_tick=FLUSH_S)
    stream = rerun.RecordingStream("hcpg robot replay", batcher_config=batching)
    stream.save(path, default_blueprint=_layout())
    stream.log("about", rerun.TextDocument(f"{trial.title}\n\n{_LEGEND}"), static=True)
    posing = _posing(trial)
    _still(stream, trial, posing)
    limits = sorted({name for tick in trial.ticks for name in tick.touched})
    for tick in trial.ticks:
        stream.set_time("tick", sequence=tick.number)
        stream.set_time("time", duration=tick.time_s)
        _moved(stream, tick, posing)
        _arrows(stream, tick)
        _told(stream, tick)
        for name, values in _numbers(tick, limits):
            stream.log(name, rerun.Scalars(values))
    stream.flush()
    stream.disconnect()


def _posing(trial: LoggedTrial) -> Posing | None:
    """The scene of the arm's tasks; None for an arm that has no joints to draw."""
    name = trial.facts["task"].rpartition("/")[2]
    return Posing(name) if name in SCENES and trial.ticks[0].joint_angles.size == 7 else None


def _still(stream: "RecordingStream", trial: LoggedTrial, posing: Posing | None) -> None:
    """What never changes: shapes within their bodies, the box, the way the TCP went."""
    import rerun

    if trial.box_m is not None:
        low, high = trial.box_m
        box = rerun.Boxes3D(mins=[low], sizes=[high - low], colors=[(120, 120, 120)], radii=0.0005)
        stream.log("world/limits/box", box, static=True)
    path = rerun.LineStrips3D([[each.position for each in trial.ticks]], colors=[(*TOOL, 120)], radii=0.001)
    stream.log("world/path", path, static=True)
    for shape in posing.shapes() if posing is not None else ():
        entity = f"{ARM}/{shape.body}/{shape.name}"
        place = rerun.Transform3D(
            translation=shape.pose.position, quaternion=rerun.Quaternion(xyzw=shape.pose.quaternion)
        )
        stream.log(entity, place, static=True)
        stream.log(entity, _drawn(shape), static=True)


def _drawn(shape: Shape) -> Any:
    import rerun

    if shape.kind == "mesh":
        corners = shape.vertices[shape.faces.ravel()]  # every face its own corners: edges then stay sharp
        return rerun.Mesh3D(
            vertex_positions=corners,
            triangle_indices=np.arange(len(corners)).reshape(-1, 3),
            vertex_normals=_normals(corners),
            albedo_factor=shape.color,
        )
    solid = {"colors": [shape.color], "fill_mode": "solid"}
    if shape.kind == "box":
        return rerun.Boxes3D(half_sizes=[shape.half_sizes], **solid)
    if shape.kind == "cylinder":
        radius, half_length = shape.half_sizes[:2]
        return rerun.Cylinders3D(lengths=[2 * half_length], radii=[radius], **solid)
    return rerun.Ellipsoids3D(half_sizes=[shape.half_sizes], **solid)


def _normals(corners: np.ndarray) -> np.ndarray:
    faces = corners.reshape(-1, 3, 3)
    across = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
    length = np.linalg.norm(across, axis=1, keepdims=True)
    return np.repeat(across / np.maximum(length, 1e-12), 3, axis=0)


def _moved(stream: "RecordingStream", tick: LoggedTick, posing: Posing | None) -> None:
    import rerun

    if posing is not None:
        posing.pose(tick.joint_angles, tick.width_m, tick.sights)
        for name, pose in posing.bodies():
            place = rerun.Transform3D(
                translation=pose.position, quaternion=rerun.Quaternion(xyzw=pose.quaternion)
            )
            stream.log(f"{ARM}/{name}", place)
    tcp = rerun.Points3D([tick.position], colors=[TOOL], radii=0.006, labels=["TCP"])
    stream.log("world/tcp", tcp)
    for name, position in tick.sights.items():
        seen = rerun.Points3D([position], colors=[GOAL], radii=0.008, labels=[f"{name}, as seen"])
        stream.log(f"world/seen/{name}", seen)
    if tick.target is not None:
        target = rerun.Points3D([tick.target], colors=[BLEND], radii=0.004)
        stream.log("world/target", target)


def _arrows(stream: "RecordingStream", tick: LoggedTick) -> None:
    """Every proposal, and what was executed; nothing of either where the arm was held."""
    import rerun

    if tick.chosen is None:
        stream.log("world/proposals", rerun.Clear(recursive=False))
    else:
        weights = tick.chosen.weights
        opacity = (60 + 195 * weights / weights.max()).astype(int)
        proposals = rerun.Arrows3D(
            origins=np.tile(tick.position, (len(weights), 1)),
            vectors=UNIT_M * tick.chosen.proposals[:, :3],
            colors=[(*OBJECT, int(each)) for each in opacity],
            radii=0.001 + 0.003 * weights,
            labels=[f"{weight:.2f}" for weight in weights],
        )
        stream.log("world/proposals", proposals)
    if tick.executed is None:
        stream.log("world/executed", rerun.Clear(recursive=False))
    else:
        vectors = [UNIT_M * tick.executed[:3]]
        executed = rerun.Arrows3D(origins=[tick.position], vectors=vectors, colors=[BLEND], radii=0.003)
        stream.log("world/executed", executed)


def _told(stream: "RecordingStream", tick: LoggedTick) -> None:
    """Words: the loop's state, why, and which limits were touched."""
    import rerun

    level = rerun.TextLogLevel.INFO if tick.state == "run" else rerun.TextLogLevel.WARN
    cause = f": {tick.cause}" if tick.cause else ""
    stream.log("loop/state", rerun.TextLog(f"{tick.state}{cause}", level=level))
    if tick.touched:
        stream.log("limits/touched", rerun.TextLog(", ".join(tick.touched)))


def _numbers(tick: LoggedTick, limits: list[str]) -> Iterator[tuple[str, Any]]:
    """Every series at this tick; what is not known has no value there."""
    yield from ((f"limits/{name}", float(name in tick.touched)) for name in limits)
    yield "limits/count", float(len(tick.touched))
    yield "episode/success", float(tick.success)
    yield "episode/held", float(tick.executed is None)
    yield "episode/gripper_width_mm", 1000 * tick.width_m
    timing = {
        "lateness_ms": tick.lateness_ms,
        "policy_ms": tick.policy_ms,
        "state_age_ms": tick.state_age_ms,
        "sight_age_ms": tick.sight_age_ms,
    }
    yield from ((f"timing/{name}", value) for name, value in timing.items() if np.isfinite(value))
    if tick.chosen is not None:
        yield "selector/weights", tick.chosen.weights
        yield "selector/spread", tick.chosen.spread
        if np.isfinite(tick.chosen.phase):
            yield "selector/scores", tick.chosen.scores
            yield "selector/phase", tick.chosen.phase


def _layout() -> "Blueprint":
    """The scene beside what it is, the numbers below."""
    from rerun import blueprint as view

    words = view.Vertical(
        view.TextDocumentView(origin="about", name="about"), view.TextLogView(origin="/", name="loop, limits")
    )
    scene = view.Horizontal(view.Spatial3DView(origin="world", name="scene"), words, column_shares=[3, 1])
    numbers = view.Horizontal(
        view.TimeSeriesView(origin="selector/weights", name="weights"),
        view.TimeSeriesView(origin="selector/phase", name="phase: 0 approach, 1 task"),
        view.TimeSeriesView(origin="limits", name="limits touched"),
        view.TimeSeriesView(origin="timing", name="timing, ms"),
    )
    return view.Blueprint(view.Vertical(scene, numbers, row_shares=[2, 1]), collapse_panels=True)
