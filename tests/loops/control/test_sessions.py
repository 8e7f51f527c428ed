import signal

import numpy as np
import pytest
from point_rig import crew, new_rig, rows, uniform

from hcpg.loops.control.mending import Patience
from hcpg.loops.control.sessions import Session
from hcpg.loops.control.step_log import LogError
from hcpg.loops.control.workers import InlineWorker
from hcpg.safety.faults import FaultyRobot


class StandInLearner:
    """Lives until it was offered `lives` episodes."""

    def __init__(self, lives):
        self.lives, self.offered = lives, []

    def alive(self):
        return len(self.offered) < self.lives

    def offer(self, result):
        self.offered.append(result.start)


def session(folder, horizon=8, patience=None, **parts):
    made = crew(folder, **parts)
    return Session(made, InlineWorker(made.rig.robot.clock), horizon, patience), made


def faulty():
    rig = new_rig()
    robot = FaultyRobot(rig.robot)
    return rig._replace(robot=robot), robot


def events(folder):
    return [(row["state"], row["cause"]) for row in rows(folder, "event")]


def test_every_start_is_run_and_the_robot_is_let_go(tmp_path):
    made, parts = session(tmp_path)
    done = made.run([4, 2])
    assert ([each.start for each in done.episodes], done.ended) == ([4, 2], "")
    assert parts.rig.robot.observe().mode == "disconnected"
    assert [row["episode"] for row in rows(tmp_path, "episode")] == [0, 1]
    assert [row["info"]["name"] for row in rows(tmp_path, "connected")] == ["point"]
    assert rows(tmp_path, "connected")[0]["limits"]["step_m"] == 0.02


def test_each_start_has_its_own_layout(tmp_path):
    made, parts = session(tmp_path)
    done = made.run([0, 1, 0])
    first, second, again = (each.records[-1].sight["object"].position for each in done.episodes)
    parts.rig.stage.arrange(1)
    assert np.abs(second - parts.rig.stage.places["object"]).max() < 0.01  # noise: 1 mm
    assert np.linalg.norm(first - second) > 0.02
    assert np.linalg.norm(first - again) < 0.01


def test_a_slow_recovery_is_waited_for_and_the_next_episode_runs(tmp_path):
    rig, robot = faulty()

    def propose(observation, count, draw):
        if draw == 5:
            robot.wrong.recover_s = 7.0
            robot.strike("reflex")
        return uniform(observation, count, draw)

    made, _ = session(tmp_path, rig=rig, propose=propose)
    done = made.run([0, 1])
    assert [each.ended for each in done.episodes] == ["fault", "time_limit"]
    assert events(tmp_path)[2:] == [
        ("reflex", "to be cleared"), ("recover", "attempt 1"), ("hold", "recovered"),
    ]  # fmt: skip
    times = {row["cause"]: row["time_s"] for row in rows(tmp_path, "event")}
    assert times["recovered"] - times["attempt 1"] == pytest.approx(7.0)
    assert robot.seen.applied_while_wrong == 0


def test_attempts_are_spaced_and_counted(tmp_path):
    rig, robot = faulty()
    robot.wrong.connects_failing = 100
    made, _ = session(tmp_path, rig=rig, patience=Patience(pause_s=0.5, connects=3))
    done = made.run([0])
    assert (done.episodes, done.ended) == ((), "the robot cannot be reached; look at it before going on")
    tries = [row["time_s"] for row in rows(tmp_path, "event") if row["cause"].startswith("attempt")]
    assert tries == pytest.approx([0.0, 0.5, 1.5])


def test_a_call_that_takes_longer_than_its_limit_is_given_up(tmp_path):
    rig, robot = faulty()

    def propose(observation, count, draw):
        if draw == 5:
            robot.wrong.recover_s = 100.0
            robot.strike("reflex")
        return uniform(observation, count, draw)

    made, _ = session(tmp_path, rig=rig, propose=propose, patience=Patience(recover_s=4.0))
    done = made.run([0, 1])
    assert done.ended == "the robot did not recover; look at it before going on"
    assert ("recover", "no answer within 6.0 s; restart the controller") in events(tmp_path)


def test_faults_in_a_row_end_the_session_and_a_good_episode_forgives(tmp_path):
    rig, robot = faulty()
    bad = {0, 1, 3, 4, 5, 6, 7}

    def propose(observation, count, draw):
        if draw // 1_000_000 in bad and draw % 1_000_000 == 4:
            robot.strike("reflex")
        return uniform(observation, count, draw)

    made, _ = session(tmp_path, rig=rig, propose=propose)
    done = made.run(range(9))
    # Three in a row are mended, the fourth (episode 6) is not; episode 2 was good and forgave the first two.
    assert [each.ended for each in done.episodes] == ["fault", "fault", "time_limit"] + ["fault"] * 4
    assert done.ended == "4 faults in a row; look at the robot before going on"


def test_a_lost_connection_is_made_anew_not_recovered(tmp_path):
    rig, robot = faulty()

    def propose(observation, count, draw):
        if draw == 5:
            robot.strike("disconnected")
        return uniform(observation, count, draw)

    made, _ = session(tmp_path, rig=rig, propose=propose)
    assert [each.ended for each in made.run([0, 1]).episodes] == ["fault", "time_limit"]
    assert events(tmp_path)[2:] == [("reconnect", "attempt 1"), ("hold", "connected")]


def test_a_reset_that_fails_is_mended_too(tmp_path):
    rig, robot = faulty()
    made, _ = session(tmp_path, rig=rig)
    learner = StandInLearner(lives=9)
    learner.offer = lambda result: robot.strike("reflex") if result.start == 0 else None
    done = made.run([0, 1], "train", learner)
    assert [each.ended for each in done.episodes] == ["time_limit", "time_limit"]
    assert ("hold", "reset: the robot is in mode reflex (injected)") in events(tmp_path)


def test_training_stops_when_the_learner_dies_and_evaluation_goes_on(tmp_path):
    learner = StandInLearner(lives=1)
    made, _ = session(tmp_path)
    done = made.run([3, 4, 5], "train", learner)
    assert (len(done.episodes), done.ended) == (1, "the learner died, so training stops here")
    assert learner.offered == [3]
    again, _ = session(tmp_path)
    done = again.run([3, 4, 5], "evaluate", StandInLearner(lives=1))
    assert (len(done.episodes), done.ended) == (3, "")
    said = [cause for _, cause in events(tmp_path) if "learner" in cause]
    assert said == ["the learner died; evaluation goes on with the last policy"]


def test_ctrl_c_ends_the_session_with_the_arm_stopped(tmp_path):
    rig, sent = new_rig(), []

    def propose(observation, count, draw):
        if draw == 6:
            signal.raise_signal(signal.SIGINT)
        sent.append(draw)
        return uniform(observation, count, draw)

    made, parts = session(tmp_path, rig=rig, propose=propose)
    done = made.run([0, 1])
    assert (done.episodes[0].ended, done.ended) == ("stopped", "signal SIGINT")
    assert len(done.episodes) == 1
    assert done.episodes[0].records[6].ack.refusal == "stopped"  # the tick it came in moved nothing any more
    assert parts.button.signal == signal.SIGINT


def test_whatever_the_policy_raises_leaves_the_robot_stopped_and_the_log_closed(tmp_path):
    made, parts = session(tmp_path, propose=lambda *_: {}[1])
    with pytest.raises(KeyError):
        made.run([0])
    assert parts.rig.robot.observe().mode == "disconnected"
    assert rows(tmp_path)[-1]["verdict"]["cause"] == "the policy failed: KeyError(1)"


def test_a_driver_that_breaks_is_not_mistaken_for_a_robot_that_refuses(tmp_path):
    rig = new_rig()

    def broken(*_):
        raise ZeroDivisionError

    rig.robot.reset = broken
    made, parts = session(tmp_path, rig=rig)
    with pytest.raises(ZeroDivisionError):
        made.run([0])
    assert parts.rig.robot.observe().mode == "disconnected"


def test_steps_that_cannot_be_written_at_all_are_not_passed_over(tmp_path):
    class NoDisk:
        def write(self, content):
            raise OSError(5, "Input/output error")

        def close(self):
            pass

    made, parts = session(tmp_path)
    parts.log._sink.close()
    parts.log._sink = NoDisk()
    with pytest.raises(LogError, match="Input/output error"):
        made.run([0])
    assert parts.rig.robot.observe().mode == "disconnected"
