"""A scene as it was at one moment of a log: the arm by its joint angles, the things by where they were seen.

Nothing is simulated here. What a log does not hold is worked out: a button is as deep as the tip that is
on it, and a ball's long axis points away from the arm.
"""

import importlib
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from hcpg.twin.bodies import HOME_ANGLES, Addresses
from hcpg.twin.physics import TIMESTEP_S
from hcpg.twin.scenes import build, scene
from hcpg.types import Float, Int

BUTTON_RADIUS_M, BUTTON_TRAVEL_M = 0.025, 0.012
Sights = Mapping[str, Float[np.ndarray, " 3"]]


class Pose(NamedTuple):
    """Where a body is, in the arm's base frame."""

    position: Float[np.ndarray, " 3"]
    """m."""
    quaternion: Float[np.ndarray, " 4"]
    """(x, y, z, w)."""


class Shape(NamedTuple):
    """One piece of a body."""

    body: str
    name: str
    kind: str
    """`mesh`, `box`, `cylinder` or `ellipsoid`."""
    pose: Pose
    """In the body's frame."""
    half_sizes: Float[np.ndarray, " 3"]
    """m; of a cylinder radius, half its length and 0."""
    vertices: Float[np.ndarray, "V 3"]
    """m; none where it is no mesh."""
    faces: Int[np.ndarray, "F 3"]
    color: tuple[int, int, int]


class Posing:
    """Puts one task's scene into the poses of a log."""

    def __init__(self, task: str) -> None:
        """`task` is the part of its name after the slash.

        Raises:
            ValueError: the twin has no such task.
        """
        self._mujoco: Any = importlib.import_module("mujoco")
        self.scene = scene(task)
        self.model = build(self.scene, TIMESTEP_S)
        self.data = self._mujoco.MjData(self.model)
        self._at = Addresses.of(self.model)
        self._fixture = self.model.body("fixture").id
        self._nominal = self.model.body_pos[self._fixture].copy()
        self._joints = {self.model.joint(joint).name for joint in range(self.model.njnt)}
        self.pose(HOME_ANGLES, 0.0, {})
        site = "goal" if self.scene.moving else "object"
        self._surveyed = self.data.site(site).xpos.copy() if self.scene.fixed else np.zeros(3)

    def pose(self, joint_angles: Float[np.ndarray, " 7"], width_m: float, sights: Sights) -> None:
        """Put the arm, its fingers and the things where they were; `data` then holds all positions."""
        self.data.qpos[self._at.arm] = joint_angles
        self.data.qpos[self._at.fingers] = width_m / 2.0
        if self.scene.fixed in sights:
            self.model.body_pos[self._fixture] = self._nominal + sights[self.scene.fixed] - self._surveyed
        if "drawer" in self._joints and {"drawer", "cabinet"} <= set(sights):
            self.data.joint("drawer").qpos[0] = max(sights["cabinet"][0] - sights["drawer"][0], 0.0)
        if "ball" in self._joints and "ball" in sights:
            self.data.joint("ball").qpos[:7] = [*sights["ball"], 1.0, 0.0, 0.0, 0.0]
        if "button" in self._joints:
            self._press()
        self._mujoco.mj_forward(self.model, self.data)

    def bodies(self) -> Iterator[tuple[str, Pose]]:
        """Every body that has a shape, and where it is now."""
        for body in sorted({int(each) for each in self.model.geom_bodyid}):
            yield self._body_name(body), Pose(self.data.xpos[body].copy(), np.roll(self.data.xquat[body], -1))

    def shapes(self) -> Iterator[Shape]:
        """What the bodies are made of, the table's surface apart."""
        kinds = self._mujoco.mjtGeom
        names = {kinds.mjGEOM_MESH: "mesh", kinds.mjGEOM_BOX: "box"}
        names |= {kinds.mjGEOM_CYLINDER: "cylinder", kinds.mjGEOM_ELLIPSOID: "ellipsoid"}
        for geom in range(self.model.ngeom):
            kind = names.get(self._mujoco.mjtGeom(self.model.geom_type[geom]))
            if kind is not None:
                yield self._shape(geom, kind)

    def _shape(self, geom: int, kind: str) -> Shape:
        model = self.model
        material = model.geom_matid[geom]
        color = model.geom_rgba[geom] if material < 0 else model.mat_rgba[material]
        pose = Pose(model.geom_pos[geom].copy(), np.roll(model.geom_quat[geom], -1))
        vertices, faces = np.zeros((0, 3)), np.zeros((0, 3), int)
        if kind == "mesh":
            mesh = model.mesh(model.geom_dataid[geom])
            first, count = mesh.vertadr[0], mesh.vertnum[0]
            vertices = model.mesh_vert[first : first + count].astype(float)
            faces = model.mesh_face[mesh.faceadr[0] : mesh.faceadr[0] + mesh.facenum[0]].astype(int)
        red, green, blue = (int(255 * each) for each in color[:3])
        own = model.geom(geom).name or f"{kind}_{geom}"
        body = self._body_name(int(model.geom_bodyid[geom]))
        return Shape(body, own, kind, pose, model.geom_size[geom].copy(), vertices, faces, (red, green, blue))

    def _body_name(self, body: int) -> str:
        return self.model.body(body).name

    def _press(self) -> None:
        """The button is pushed in as far as the tip is below its top."""
        self.data.joint("button").qpos[0] = 0.0
        self._mujoco.mj_kinematics(self.model, self.data)
        top, tip = self.data.site_xpos[self._at.object], self.data.site_xpos[self._at.tip]
        over = float(np.linalg.norm((top - tip)[:2])) < BUTTON_RADIUS_M
        self.data.joint("button").qpos[0] = np.clip(top[2] - tip[2], 0.0, BUTTON_TRAVEL_M) if over else 0.0


def quaternion_of(frame: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, " 4"]:
    """Of a rotation matrix, scalar first, as a model has it."""
    mujoco: Any = importlib.import_module("mujoco")
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(frame).ravel())
    return quaternion
