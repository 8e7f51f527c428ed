import numpy as np
import pytest
from point_rig import ROBOT_TASK, Scripted, constant, episode, new_rig, ready, rows, uniform

from hcpg.loops.control.episodes import Episode
from hcpg.robot_types import Ack
from hcpg.robots.point import LAG_S, LIMITS


def greedy(observation, count, draw):
    """Straight to the object, one unit at the most."""
    way = (observation[4:7] - observation[0:3]) / LIMITS.step_m
    return np.tile([*np.clip(way, -1, 1), 0.0], (count, 1)).astype(np.float64)


def test_an_expert_succeeds_and_the_count_is_of_actions(tmp_path):
    result = episode(tmp_path, horizon=60, propose=greedy)
    assert result.ended == "success"
    assert result.steps_to_success == result.actions
    assert result.held == len(result.records) - result.actions
    last = result.records[-1]
    apart = last.snapshot.position - last.sight["object"].position
    assert last.success
    assert np.linalg.norm(apart) <= 0.02
    assert not any(record.success for record in result.records[:-1])


def test_the_first_step_by_hand(tmp_path):
    # The ramp's first step is a sixth of 20 mm; in one period the arm covers 1 - exp(-33.3 / 40) of it.
    records = episode(tmp_path, horizon=3, propose=constant(1.0, 0, 0, 0)).records
    first = next(number for number, record in enumerate(records) if record.executed is not None)
    assert records[first].executed.tolist() == pytest.approx([1 / 6, 0, 0, 0])
    assert records[first].limited.touched == ("ramp",)
    moved = records[first + 1].snapshot.position - records[first].snapshot.position
    assert moved == pytest.approx([0.02 / 6 * (1 - np.exp(-1 / 30 / LAG_S)), 0, 0])
    assert records[first + 1].executed[0] == pytest.approx(2 / 6)


def test_it_holds_until_the_objects_are_seen(tmp_path):
    # Pictures are answered after 100 ms: at ticks 0, 1 and 2 nothing is known.
    records = episode(tmp_path, horizon=3).records
    causes = [record.verdict.cause for record in records[:4]]
    assert causes == ["an object was never seen"] * 3 + [""]
    assert [record.observation is None for record in records[:4]] == [True, True, True, False]


def test_the_policy_may_take_most_of_a_period_and_no_more(tmp_path):
    def taking(share):
        rig = new_rig()

        def propose(observation, count, draw):
            rig.robot.clock.sleep_until(rig.robot.clock.now_s() + share / 30)
            return uniform(observation, count, draw)

        return episode(tmp_path, horizon=5, rig=rig, propose=propose)

    in_time = taking(0.75)
    assert (in_time.actions, in_time.timing.skipped) == (5, 0)
    assert in_time.records[4].policy_s == pytest.approx(0.75 / 30)
    late = taking(0.85)
    assert (late.ended, late.actions, late.timing.skipped) == ("fault", 0, 0)
    assert {record.verdict.cause for record in late.records[3:]} == {"the policy was late"}
    assert len({tuple(record.snapshot.position) for record in late.records}) == 1


def test_a_refused_command_is_a_hold(tmp_path):
    rig = new_rig()
    robot = Scripted(rig.robot, command=lambda robot, command: Ack(False, "lead"))
    result = episode(tmp_path, horizon=4, rig=rig._replace(robot=robot))
    assert result.actions == 0
    record = result.records[3]
    assert (record.verdict.state, record.verdict.cause) == ("hold", "the robot refused the command: lead")
    assert record.executed is None
    assert record.limited is not None


def test_commands_carry_rising_numbers_and_the_epoch_of_their_snapshot(tmp_path):
    rig, sent = new_rig(), []

    def command(robot, wanted):
        sent.append((wanted.sequence, wanted.epoch, robot.observe().epoch))
        return robot.command(wanted)

    made = ready(tmp_path, rig=rig._replace(robot=Scripted(rig.robot, command=command)))
    for number in range(2):
        Episode(made, number, number, 4).run()
        made.rig.robot.reset(ROBOT_TASK.home, "open", 5.0)
    assert [sequence for sequence, _, _ in sent] == list(range(8))
    assert all(epoch == running for _, epoch, running in sent)
    assert sent[0][1] < sent[-1][1]


def test_an_epoch_that_ends_under_the_episode_ends_it(tmp_path):
    rig = new_rig()

    def propose(observation, count, draw):
        if draw == 10:
            rig.robot.recover(1.0)  # somebody else clears errors, between observation and command
        return uniform(observation, count, draw)

    result = episode(tmp_path, horizon=30, rig=rig, propose=propose)
    assert (result.ended, result.verdict.cause) == ("fault", "a new epoch began in the episode")
    assert result.records[10].ack == Ack(False, "epoch")  # that tick's command was of the old one
    assert result.records[-1].tick.number == 11


def test_what_the_policy_raises_is_raised_after_a_hold_that_is_logged(tmp_path):
    def propose(observation, count, draw):
        return {3: np.zeros((count, 4))}[draw]

    made = ready(tmp_path, propose=propose)
    with pytest.raises(KeyError, match="4"):
        Episode(made, 0, 0, 9).run()
    assert [row["verdict"]["cause"] for row in rows(tmp_path)[3:]] == ["", "the policy failed: KeyError(4)"]
    target = made.rig.robot.observe().position
    made.rig.robot.clock.sleep_until(made.rig.robot.clock.now_s() + 1)
    assert made.rig.robot.observe().position == pytest.approx(target)


def test_after_a_hold_the_ramp_begins_anew(tmp_path):
    def propose(observation, count, draw):
        return np.full((count, 4), np.nan if draw == 12 else 0.0) + np.array([1.0, 0, 0, 0])

    records = episode(tmp_path, horizon=14, propose=propose).records
    shares = [record.executed[0] for record in records[9:16] if record.executed is not None]
    assert shares == pytest.approx([1, 1, 1, 1 / 6, 2 / 6, 3 / 6])


def test_success_is_not_judged_on_a_state_that_is_not_fresh(tmp_path):
    class Always:
        def update(self, snapshot, sight):
            return True

    rig = new_rig()
    frozen = rig.robot.observe()
    robot = Scripted(rig.robot, observe=lambda robot: frozen)
    made = ready(
        tmp_path,
        rig=rig._replace(robot=robot),
        task=ROBOT_TASK.__class__(**{**vars(ROBOT_TASK), "make_detector": Always}),
    )
    result = Episode(made, 0, 0, 9).run()
    assert (result.ended, result.verdict.state) == ("fault", "reconnect")
    assert result.steps_to_success == -1
