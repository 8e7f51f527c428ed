"""The button's detector, which knows joints and a touched-off place alone, against the button's travel."""

import pytest

from hcpg import registry
from hcpg.robots.twin.eyes import TwinEyes
from hcpg.twin.experts import STEP_M, Moment, act
from hcpg.twin.world import World

pytest.importorskip("mujoco")
TICK_S, TICKS = 1.0 / 30.0, 240


def travel_when_detected_m(world, start, speed):
    """How far the button has gone when the detector first says that it is pressed."""
    world.place(start)
    eyes, detector = (
        TwinEyes(world, world.scene, 7),
        registry.robot_task("franka/button-press").make_detector(),
    )
    for tick in range(1, TICKS + 1):
        truth, tool = world.truth(), world.physics.position
        delta = act("button-press", Moment(tool, truth.tip, truth.object, truth.goal, 0.0), speed)
        world.physics.aim(tool + STEP_M * delta)
        world.sleep_until(tick * TICK_S)
        snapshot = world.snapshot(1)
        if detector.update(snapshot, eyes.look(snapshot, snapshot.host_time_s)):
            return float(world.physics.data.joint("button").qpos[0])
    pytest.fail(f"start state {start} at speed {speed}: not pressed within {TICKS} ticks")


@pytest.mark.parametrize(("start", "speed"), [(1, 1.0), (2, 0.6)])
def test_it_says_pressed_only_once_the_button_has_gone_10_mm(start, speed):
    assert travel_when_detected_m(World("button-press", 5), start, speed) >= 0.010
