"""The README of an exported policy: what it is, what it was measured to do, and where it must not be used."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from hcpg.report.records import Record
from hcpg.report.statistics import wilson

LIMITS = """\
- It was trained and measured in the simulation that the task names. Nothing here is evidence about an arm.
- The interval says how well the episodes measure this one policy, not how much training seeds differ.
- It knows no safety: run it behind limits that are always on (`hcpg.safety`, docs/robot_safety.md), and on
  an arm at first at 20 % of the step.
- It reads observations as the task defines them, in the same units and frame; far from those of its training
  it may do anything.
- Actions are samples, unless it acts alone by a Gaussian's mean: two calls differ, and so do two episodes.
- The manifest finds damage and mix-ups. Whoever can write the folder can write another policy into it:
  compare the digest that `hcpg export` printed.
"""
USE = """\
NumPy and safetensors are enough: `pip install hcpg-flow safetensors`.

```python
import numpy as np
from hcpg.loops.control.deployed import Policy

policy = Policy.load("FOLDER")  # refuses a folder that was altered
action = policy.act(observation, np.random.default_rng())
```

`python -m hcpg.loops.control.deployed FOLDER` times it at 30 Hz on this machine.
"""


class Evaluation(NamedTuple):
    """One evaluation of the run, at or before the exported step."""

    selector: str
    step: int
    successes: int
    episodes: int
    low: float
    """Lower end of the 95 % Wilson interval of the success rate."""
    high: float


def last_evaluations(run: Record, step: int) -> tuple[Evaluation, ...]:
    """The last evaluation up to `step` with each selector that the run was evaluated with."""
    found = []
    for selector, curve in run.curves.items():
        before = np.flatnonzero(curve.steps <= step)
        if before.size:
            last = before[-1]
            counts = (int(curve.successes[last]), int(curve.episodes[last]))
            found.append(Evaluation(selector, int(curve.steps[last]), *counts, *wilson(*counts)))
    return tuple(found)


def model_card(facts: Mapping[str, Any], evaluations: Sequence[Evaluation]) -> str:
    """The card, in Markdown, from the facts of `policy.json`."""
    origin, selector = facts["origin"], facts["selector"]
    alone = selector["candidates"] == 1
    chooses = "the method's own action" if alone else f"{selector['rule']} over K = {selector['candidates']}"
    sizes = (facts["observation_size"], facts["action_size"])
    rows = {
        "task": f"`{facts['task']}`",
        "adapter": f"`{facts['adapter']}`{_other_adapter(facts)}",
        "preset": f"`{origin['preset']}` (method `{origin['method']}`, network `{facts['network']['kind']}`)",
        "acts by": chooses,
        "budget": f"`{origin['budget']}`, {origin['budget_steps']:,} environment steps",
        "seed": str(origin["seed"]),
        "step": f"{origin['step']:,}",
        "run": f"`{origin['run']}`, hcpg {origin['hcpg_version']}",
        "in, out": "{} observed numbers; {} of an action, in [-1, 1]".format(*sizes),
    }
    lines = ["| | |", "| --- | --- |", *(f"| {name} | {value} |" for name, value in rows.items())]
    return "\n".join(
        [
            "---\nlibrary_name: hcpg-flow\ntags: [robotics, reinforcement-learning]\n---\n",
            f"# {origin['preset']} on {facts['task']}, seed {origin['seed']}\n",
            *lines,
            "\n## Last evaluation\n",
            *_evaluation_lines(evaluations),
            "\n## Limits of use\n",
            LIMITS,
            "## Use\n",
            USE,
        ]
    )


def _other_adapter(facts: Mapping[str, Any]) -> str:
    own = facts["origin"]["adapter_of_run"]
    return "" if own == facts["adapter"] else f" (the run was trained and evaluated with `{own}`)"


def _evaluation_lines(evaluations: Sequence[Evaluation]) -> list[str]:
    if not evaluations:
        return ["None was made up to this step. If an arm ran it, the trials' ledger says how it did."]
    head = ["| acting by | after step | successes | rate, 95 % interval |", "| --- | --- | --- | --- |"]
    return head + [
        f"| `{each.selector}` | {each.step:,} | {each.successes} of {each.episodes} | "
        f"{100 * each.successes / each.episodes:.1f} % [{100 * each.low:.1f}, {100 * each.high:.1f}] |"
        for each in evaluations
    ]
