"""The faults of a drill, by name; what a network, a controller, a policy, a camera or a disk can do."""

from collections.abc import Callable, Mapping

import numpy as np

from hcpg.loops.control.drill import Fault, Site
from hcpg.robot_types import Mode


def _set(**values: object) -> Callable[[Site], None]:
    """Make the robot go wrong in these fields of `safety.faults.Wrong`."""

    def inject(site: Site) -> None:
        for name, value in values.items():
            setattr(site.robot.wrong, name, value)

    return inject


def _strike(mode: Mode, **values: object) -> Callable[[Site], None]:
    def inject(site: Site) -> None:
        _set(**values)(site)
        site.robot.strike(mode)

    return inject


def _spoil(spoil: Callable[[np.ndarray], np.ndarray]) -> Callable[[Site], None]:
    def inject(site: Site) -> None:
        site.spoil = spoil

    return inject


def _unspoil(site: Site) -> None:
    site.spoil = lambda proposals: proposals


def _late(late_s: float) -> Callable[[Site], None]:
    def inject(site: Site) -> None:
        def spoil(proposals: np.ndarray) -> np.ndarray:
            site.robot.clock.sleep_until(site.robot.clock.now_s() + late_s)
            return proposals

        site.spoil = spoil

    return inject


def _blind(site: Site) -> None:
    site.blind = True


def _see(site: Site) -> None:
    site.blind = False


def _kill_learner(site: Site) -> None:
    site.learner.kill()
    site.learner.wait()


def _fill_disk(site: Site) -> None:
    site.disk.full = True


def _press_twice(site: Site) -> None:
    site.button.press("a person pressed stop")
    site.button.press("a person pressed stop again")


def _filled(value: float) -> Callable[[np.ndarray], np.ndarray]:
    return lambda proposals: np.full_like(proposals, value)


def _narrowed(proposals: np.ndarray) -> np.ndarray:
    return proposals[:, 1:]


def _driving(axis: int, sign: float) -> Callable[[np.ndarray], np.ndarray]:
    """Proposals that all go one way along an axis."""

    def drive(proposals: np.ndarray) -> np.ndarray:
        driven = np.zeros_like(proposals)
        driven[:, axis] = sign
        return driven

    return drive


def _closing(proposals: np.ndarray) -> np.ndarray:
    if proposals.shape[1] < 4:
        return proposals
    closing = proposals.copy()
    closing[:, 3] = -1.0
    return closing


def _refuse_grip(site: Site) -> None:
    site.robot.wrong.grip_refused = True
    site.spoil = _closing


FAULTS: Mapping[str, Fault] = {
    "none": Fault("nothing, for comparison", lambda site: None),
    "freeze_300_ms": Fault("no new state for 300 ms", _set(frozen=True), 9, _set(frozen=False)),
    "freeze_for_good": Fault("no new state any more", _set(frozen=True)),
    "replayed_states": Fault("old states arrive for 300 ms", _set(repeated=True), 9, _set(repeated=False)),
    "nan_state": Fault(
        "the measured position is NaN for 5 ticks", _set(not_finite=True), 5, _set(not_finite=False)
    ),
    "reflex": Fault("one reflex", _strike("reflex")),
    "reflex_storm": Fault("a reflex at every tick", _strike("reflex"), repeats=True),
    "recovery_0.7_s": Fault("a reflex, cleared after 0.7 s", _strike("reflex", recover_s=0.7)),
    "recovery_7_s": Fault("a reflex, cleared after 7 s", _strike("reflex", recover_s=7.0)),
    "recovery_30_s": Fault("a reflex, cleared later than is waited for", _strike("reflex", recover_s=30.0)),
    "recovery_fails": Fault("a reflex, cleared at attempt 3", _strike("reflex", recoveries_failing=2)),
    "cable": Fault("connection lost; attempt 2 connects", _strike("disconnected", connects_failing=1)),
    "server_gone": Fault("connection lost for good", _strike("disconnected", connects_failing=100)),
    "user_stop": Fault("the user stop is pressed", _strike("user_stopped")),
    "delay_100_ms": Fault("every command arrives 100 ms late", _set(command_delay_s=0.1)),
    "loss_30_percent": Fault("30 % of the commands are lost", _set(command_loss=0.3)),
    "burst_1.5_s": Fault("1.5 s of commands are lost", _set(command_loss=1.0), 45, _set(command_loss=0.0)),
    "late_commands_and_reflex": Fault(
        "commands arrive 200 ms late, a reflex comes first", _set(command_delay_s=0.2), 4, _strike("reflex")
    ),
    "late_policy": Fault("the policy takes 250 ms, for 2 ticks", _late(0.25), 2, _unspoil),
    "stuck_policy": Fault("the policy takes 2 s, once", _late(2.0), 1, _unspoil),
    "nan_action": Fault("proposals are NaN for 5 ticks", _spoil(_filled(np.nan)), 5, _unspoil),
    "infinite_action": Fault("proposals are infinite for 5 ticks", _spoil(_filled(np.inf)), 5, _unspoil),
    "huge_action": Fault("every number of the proposals is 1000", _spoil(_filled(1000.0))),
    "wrong_shape": Fault("proposals lack a column for 5 ticks", _spoil(_narrowed), 5, _unspoil),
    "out_of_box": Fault("the policy drives into a wall of the box", _spoil(_driving(0, 1.0)), horizon=200),
    "into_the_table": Fault("the policy drives straight down", _spoil(_driving(2, -1.0)), horizon=200),
    "frozen_perception": Fault("the camera's last picture stays", _blind),
    "camera_gap": Fault("no picture for 600 ms", _blind, 18, _see),
    "gripper_refusal": Fault("the gripper refuses every command", _refuse_grip),
    "learner_death_training": Fault("the learner is killed in training", _kill_learner, purpose="train"),
    "learner_death_evaluating": Fault("the learner is killed in an evaluation", _kill_learner),
    "full_disk": Fault("the disk is full", _fill_disk),
    "stop_twice": Fault("stop is pressed twice", _press_twice),
}
"""By name, as `hcpg robot drill --fault` takes it."""
