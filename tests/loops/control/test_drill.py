"""The fault matrix on the point arm: nothing leaves the box, acts late, hangs or goes unlogged.

The drill is made once, by its command and in a process of its own: type checks would make it minutes.
"""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from point_rig import ROBOT_TASK, TASK, new_rig

from hcpg.loops.control import drill_table
from hcpg.loops.control.drill import FIRST_TICK, DrillError, drill
from hcpg.loops.control.drill_list import FAULTS

SOURCE = Path(__file__).parents[3] / "src"
TICK_MS = 1000 / 30
LOOK = "look at it before going on"
FULL = "cannot write steps.jsonl: No space left on device (injected)"
# By fault: how the episodes ended, why the first did, ticks from fault to hold, why the session ended.
EXPECTED = {
    "none": (["success", "success"], "success", None, ""),
    "freeze_300_ms": (["success", "success"], "success", 2, ""),
    "freeze_for_good": (["fault", "success"], "no new state for 533 ms", 2, ""),
    "replayed_states": (["success", "success"], "success", 2, ""),
    "nan_state": (["success", "success"], "success", 1, ""),
    "reflex": (["fault", "success"], "the robot's reflex", 0, ""),
    "reflex_storm": (["fault", "fault"], "the robot's reflex", 0, ""),
    "recovery_0.7_s": (["fault", "success"], "the robot's reflex", 0, ""),
    "recovery_7_s": (["fault", "success"], "the robot's reflex", 0, ""),
    "recovery_30_s": (["fault"], "the robot's reflex", 0, f"the robot did not recover; {LOOK}"),
    "recovery_fails": (["fault", "success"], "the robot's reflex", 0, ""),
    "cable": (["fault", "success"], "the connection is lost", 0, ""),
    "server_gone": (["fault"], "the connection is lost", 0, f"the robot cannot be reached; {LOOK}"),
    "user_stop": (["stopped"], "the user stop is pressed", 0, "the user stop is pressed"),
    "delay_100_ms": (["time_limit", "time_limit"], "time_limit", None, ""),
    "loss_30_percent": (["success", "success"], "success", None, ""),
    "burst_1.5_s": (["time_limit", "success"], "time_limit", None, ""),
    "late_commands_and_reflex": (["fault", "time_limit"], "the robot's reflex", 4, ""),
    "late_policy": (["success", "success"], "success", 0, ""),
    "stuck_policy": (["success", "success"], "success", 0, ""),
    "nan_action": (["success", "success"], "success", 0, ""),
    "infinite_action": (["success", "success"], "success", 0, ""),
    "huge_action": (["time_limit", "time_limit"], "time_limit", None, ""),
    "wrong_shape": (["success", "success"], "success", 0, ""),
    "out_of_box": (["time_limit", "time_limit"], "time_limit", None, ""),
    "into_the_table": (["time_limit", "time_limit"], "time_limit", None, ""),
    "frozen_perception": (["time_limit", "fault"], "time_limit", 6, ""),
    "camera_gap": (["success", "success"], "success", 6, ""),
    "gripper_refusal": (["fault", "fault"], "the gripper refused 4 commands", 4, ""),
    "learner_death_training": (["success"], "success", None, "the learner died, so training stops here"),
    "learner_death_evaluating": (["success", "success"], "success", None, ""),
    "full_disk": (["stopped"], FULL, 1, FULL),
    "stop_twice": (["stopped"], "a person pressed stop", 0, "a person pressed stop"),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """What `hcpg robot drill` wrote."""
    out = tmp_path_factory.mktemp("drill")
    command = [sys.executable, "-m", "hcpg", "robot", "drill", "point/reach", "--robot", "point"]
    done = subprocess.run(
        [*command, "--out", str(out)],
        capture_output=True,
        text=True,
        env={"PYTHONPATH": str(SOURCE)},
        timeout=200,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.count("\nok ") == len(FAULTS) - 1
    return out


@pytest.fixture(scope="module")
def outcomes(folder):
    return json.loads((folder / "outcomes.json").read_text())


def steps(folder, fault, episode=0):
    rows = map(json.loads, (folder / fault / "steps.jsonl").read_text().splitlines())
    return [row for row in rows if row["kind"] == "step" and row["episode"] == episode]


def test_every_fault_has_its_expectation(outcomes):
    assert list(EXPECTED) == list(FAULTS) == list(outcomes)


@pytest.mark.parametrize("name", FAULTS)
def test_no_fault_moves_the_arm_out_of_its_box_or_past_a_reflex_or_loses_a_step(outcomes, name):
    outcome = outcomes[name]
    assert outcome["furthest_outside_mm"] < 1e-9
    assert outcome["applied_while_wrong"] == 0
    assert outcome["logged"] == outcome["ticks"] > FIRST_TICK
    # The point arm stops where it is; only while a policy blocks its clock does it go on to its last target.
    assert outcome["moved_while_held_mm"] < 5.0


@pytest.mark.parametrize("name", FAULTS)
def test_every_fault_ends_as_it_should(outcomes, name):
    outcome = outcomes[name]
    endings, cause, ticks, session_ended = EXPECTED[name]
    found = (outcome["endings"], outcome["cause"], outcome["session_ended"])
    assert found == (endings, cause, session_ended)
    after_ms = None if ticks is None else pytest.approx(ticks * TICK_MS, abs=1.0)
    assert outcome["hold_after_ms"] == after_ms


def test_after_a_mended_fault_the_next_episode_is_as_without_it(outcomes):
    without = outcomes["none"]["steps_to_success"][1]
    for name in ("reflex", "recovery_7_s", "recovery_fails", "cable", "freeze_for_good", "late_policy"):
        # The pictures' noise depends on the time, so a step more or less is no difference.
        assert outcomes[name]["steps_to_success"][1] == pytest.approx(without, abs=2)


def test_a_fault_costs_its_recovery_and_a_reset(outcomes):
    # A reset of the point arm takes 1 s, laying out 0.5 s. The pauses between three attempts are 0.5 and 1 s.
    costs = {name: outcomes[name]["cost_s"] for name in outcomes}
    assert costs["reflex"] == pytest.approx(1.53, abs=0.04)
    assert costs["recovery_7_s"] - costs["reflex"] == pytest.approx(7.0)
    assert costs["recovery_fails"] - costs["reflex"] == pytest.approx(1.5)


def test_the_wall_of_the_box_was_reached(outcomes):
    # 25 cm at 20 mm a step, with a lag: long before the 60th action; from then on every action is limited.
    for name in ("out_of_box", "into_the_table", "huge_action"):
        assert outcomes[name]["limited"]["box"] > 50
    assert outcomes["none"]["limited"].get("box", 0) == 0


def test_what_travelled_when_the_reflex_came_is_refused_afterwards(outcomes):
    # The ticks 15 to 18 sent their commands on a way of 200 ms; tick 19 had the reflex.
    assert outcomes["late_commands_and_reflex"]["refused"]["epoch"] >= 4


@pytest.mark.parametrize("name", ["nan_action", "infinite_action", "wrong_shape"])
def test_bad_proposals_cost_exactly_their_ticks_and_are_in_the_log(folder, name):
    held = [row for row in steps(folder, name)[:-1] if row["executed"] is None]
    # Three ticks before the first picture, then the five.
    assert [row["tick"]["number"] for row in held] == [0, 1, 2, 15, 16, 17, 18, 19]
    assert all(row["choice"]["unfit"].startswith("the policy gave proposals") for row in held[3:])


def test_a_camera_that_stays_away_leaves_one_proposal_and_then_nothing(folder):
    alone = [row for row in steps(folder, "frozen_perception") if row["verdict"]["alone"] and row["choice"]]
    assert {len(row["choice"]["proposals"]) for row in alone} == {1}
    assert min(row["sight_age_s"] for row in alone) > 0.9  # 0.4 s allowed and 0.5 s of hold
    # Laid out anew, and never seen since: not a single action.
    assert all(row["executed"] is None for row in steps(folder, "frozen_perception", episode=1))


def test_late_results_are_never_replayed(folder):
    rows = steps(folder, "late_policy")
    late = [row for row in rows if row["verdict"]["cause"] == "the policy was late"]
    assert [row["choice"] for row in late] == [None, None]
    assert [row["tick"]["skipped"] for row in rows if row["tick"]["skipped"]] == [7, 7]


def test_the_table_has_a_line_per_fault(folder):
    lines = (folder / "table.md").read_text().splitlines()
    named = [line.split("|")[1].strip(" `") for line in lines[2 : 2 + len(FAULTS)]]
    assert named == list(FAULTS)
    told = f"{len(FAULTS)} of {len(FAULTS)} harmless: `hcpg robot drill point/reach --robot point`."
    assert lines[-1] == told


def test_the_table_goes_into_its_place_and_nowhere_else():
    document = "a\n<!-- drill point -->\nold\n<!-- end -->\nb\n<!-- drill arm -->\n<!-- end -->\n"
    assert drill_table.inserted(document, "point", "new\n") == (
        "a\n<!-- drill point -->\n\nnew\n\n<!-- end -->\nb\n<!-- drill arm -->\n<!-- end -->\n"
    )
    with pytest.raises(DrillError, match="no place"):
        drill_table.inserted(document, "other", "new\n")


def test_a_real_arm_is_not_drilled(tmp_path):
    with pytest.raises(DrillError, match="twins"):
        drill(new_rig(), "real", ROBOT_TASK, TASK.adapters["paper"], FAULTS["none"], tmp_path)
