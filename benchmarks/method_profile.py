"""Where the time of one method's update goes: kinds of kernels and their shares, as JSON.

Usage: method_profile.py PRESET. JAX's own profiler says how long each kernel ran, and the compiled program
what is in it: `products` hold a matrix product (with what XLA fused into it), `reductions` a sum or maximum,
`copies` only move numbers, all others are `element_wise`. `between` is what passes outside kernels.
"""

import json
import os
import re
import sys
import tempfile
from collections import Counter
from pathlib import Path
from typing import Any

CALLS = 5
UPDATES_PER_CALL = 6
_CONTAINERS = ("while", "call", "conditional")
_COMPUTATION = re.compile(r"^(?:ENTRY )?%?([\w.-]+) \([^\n]*\{\n(.*?)^\}", re.MULTILINE | re.DOTALL)
_INSTRUCTION = re.compile(r"^\s+(?:ROOT )?%?([\w.-]+) = .*?(?:calls|to_apply)=%?([\w.-]+)", re.MULTILINE)


def kinds(program: str) -> dict[str, str]:
    """The kind of each fusion in a compiled program's text, by its name."""
    bodies = dict(_COMPUTATION.findall(program))
    found = {}
    for name, called in _INSTRUCTION.findall(program):
        body = bodies.get(called, "")
        found[name] = (
            "products" if " dot(" in body else "reductions" if " reduce(" in body else "element_wise"
        )
    return found


def kind_of(operation: str, fusions: dict[str, str]) -> str | None:
    """The kind of one profiled operation; None for what only holds others."""
    family = operation.split(".")[0]
    if family in _CONTAINERS:
        return None
    if family in ("copy", "slice", "bitcast", "concatenate", "transpose"):
        return "copies"
    if family in ("dot", "reduce"):
        return {"dot": "products", "reduce": "reductions"}[family]
    return fusions.get(operation, "element_wise")


def shares(events: list[Any], fusions: dict[str, str], whole_ns: float) -> dict[str, float]:
    """The share of `whole_ns` that kernels of each kind took."""
    spent: Counter[str] = Counter()
    for event in events:
        operation = dict(event.stats).get("hlo_op")
        if operation is None or event.name.startswith("end: "):
            continue
        kind = kind_of(str(operation), fusions)
        if kind is not None:
            spent[kind] += event.duration_ns
    spent["between"] = int(whole_ns - sum(spent.values()))
    return {kind: nanoseconds / whole_ns for kind, nanoseconds in sorted(spent.items())}


def main() -> None:
    """Compile, profile a few calls, print the shares."""
    os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false"
    import jax

    from benchmarks.method_step import prepared

    learn, arguments = prepared(sys.argv[1], UPDATES_PER_CALL)
    states, *rest = arguments
    program = learn.lower(states, *rest).compile().as_text()
    states = jax.block_until_ready(learn(states, *rest))[0]
    with tempfile.TemporaryDirectory() as folder:
        with jax.profiler.trace(folder):
            for _ in range(CALLS):
                states = jax.block_until_ready(learn(states, *rest))[0]
        [file] = Path(folder).rglob("*.xplane.pb")
        planes = list(jax.profiler.ProfileData.from_file(str(file)).planes)
    events = [event for plane in planes for line in plane.lines for event in line.events]
    whole = sum(
        event.duration_ns for event in events if event.name == "ThunkExecutor::Execute (wait for completion)"
    )
    print(
        json.dumps(
            {
                "updates": CALLS * UPDATES_PER_CALL,
                "seconds": whole / 1e9,
                **shares(events, kinds(program), whole),
            }
        )
    )


if __name__ == "__main__":
    main()
