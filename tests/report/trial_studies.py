"""Trials written by hand, in the form that the protocol leaves them."""

import json

from hcpg.report.trial_records import KIND, LEDGER, PLAN, digest_of

PAPER = {
    "franka/peg-insertion": {"sac_flow": (15, 30), "hcpg_flow": (15, 24)},
    "franka/rugby-grasp": {"sac_flow": (10, 60), "hcpg_flow": (14, 43)},
}
"""Successes of 15 and steps of each: the paper's counts, with steps rounded to whole actions."""
CAPS = {"franka/peg-insertion": 150, "franka/rugby-grasp": 200}


def write_study(folder, task, outcomes, kind="twin", served=True, extra=()):
    """`outcomes` has for each policy a list of steps to the first hit, -1 for a failure."""
    folder.mkdir(parents=True)
    trials = max(len(steps) for steps in outcomes.values())
    plan = {"task": task, "kind": kind, "served": served, "horizon": CAPS.get(task, 60), "trials": trials}
    plan["policies"] = {name: {} for name in outcomes}
    (folder / PLAN).write_text(json.dumps({"kind": KIND, "plan": plan, "sha256": digest_of(plan)}))
    rows, number = [], 0
    for policy, steps in outcomes.items():
        for start, each in enumerate(steps):
            number += 1
            rows += attempt(number, policy, start, each)
    (folder / LEDGER).write_text("".join(json.dumps(row) + "\n" for row in [*rows, *extra]))
    return folder


def attempt(number, policy, start, steps, **changed):
    name = {"trial": number, "attempt": 1}
    begun = {
        "row": "begun",
        **name,
        "code": f"C{number:03d}",
        "policy": policy,
        "start": start,
        "commit": "abc1234",
    }
    done = steps >= 0
    ended = {"row": "ended", **name, "ended": "success" if done else "time_limit", "cause": "", "invalid": ""}
    return [begun, {**ended, "detector": done, "steps": steps, "referee": done, **changed}]


def paper_studies(root):
    """15 trials of two policies on two tasks, with the paper's counts."""
    for task, policies in PAPER.items():
        outcomes = {name: [steps] * good + [-1] * (15 - good) for name, (good, steps) in policies.items()}
        write_study(root / task, task, outcomes)
    return root
