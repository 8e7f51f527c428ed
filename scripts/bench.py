"""Speed of this machine's CPU preset against its peers: ratios, each measured in one run. `make bench`."""

import argparse
import json
import os
import platform
import subprocess
import sys
import time
from collections.abc import Mapping
from datetime import date
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from hcpg.loops import machine

ROOT = Path(__file__).resolve().parents[1]
ENVIRONMENT = {
    **os.environ,
    "OPENBLAS_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "JAX_PLATFORMS": "cpu",
    "PYTHONWARNINGS": "ignore",
}


def this_machine() -> str:
    """What the ratios were measured on."""
    models = [
        line for line in Path("/proc/cpuinfo").read_text().splitlines() if line.startswith("model name")
    ]
    model = models[0].partition(":")[2].strip() if models else platform.machine()
    try:
        versions = ", ".join(f"{name} {version(name)}" for name in ("jax", "numpy", "metaworld", "sbx-rl"))
    except PackageNotFoundError as missing:
        raise SystemExit(
            f"{missing.name} is not installed here: `make bench` installs what the parts need"
        ) from None
    cores = len(os.sched_getaffinity(0))
    return f"{cores} cores ({model}), Python {platform.python_version()}, {versions}, {date.today()}"


def together(
    commands: list[list[str]], pinned: bool, variables: Mapping[str, str] | None = None
) -> list[dict]:
    """Run benchmark modules side by side, started at the same moment; their JSON answers."""
    cores = sorted(os.sched_getaffinity(0))
    processes = []
    for index, (module, *arguments) in enumerate(commands):
        pin = ["taskset", "-c", str(cores[index % len(cores)])] if pinned else []
        command = [*pin, sys.executable, "-m", f"benchmarks.{module}", *arguments]
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
        environment = ENVIRONMENT | dict(variables or {})
        processes.append(subprocess.Popen(command, cwd=ROOT, env=environment, **pipes))
    for process in processes:
        for line in process.stdout:
            if line.strip() == "ready":
                break
    for process in processes:
        process.stdin.write("go\n")
        process.stdin.flush()
    answers = [process.communicate()[0] for process in processes]
    failed = [process.args for process in processes if process.returncode]
    if failed:
        raise SystemExit(f"benchmark failed: {failed}")
    return [json.loads(answer.strip().splitlines()[-1]) for answer in answers]


def gradient_steps() -> list[tuple[str, float, str]]:
    """Share of one core's matrix-product rate; three seeds, started as `hcpg train` does, against one."""
    one = together([["gradient_step"]], pinned=True)[0]
    alone = together([["gradient_step"]], pinned=False)[0]
    two = together([["gradient_step"]] * 2, pinned=True)
    three = together([["gradient_step"]] * 3, pinned=False, variables=machine.one_core({}, 3))
    last = max(each["seconds"] for each in three)
    beside = max(each["seconds"] for each in two) / one["seconds"]
    share = one["rate"] / one["products"]
    print(f"  {one['operations'] / 1e9:.2f} GFLOP per update at {one['rate'] / 1e9:.0f} GFLOP/s;", end=" ")
    print(f"matrix products {one['products'] / 1e9:.0f} GFLOP/s on one core")
    return [
        ("gradient step / matrix-product rate of one core", share, ">= 0.6"),
        ("two seeds, each on its core / one seed, time", beside, "~ 1.0"),
        ("three seeds on all cores / one seed on one core, time", last / one["seconds"], "<= 1.7"),
        ("three seeds on all cores / one seed on all cores, time", last / alone["seconds"], "-"),
    ]


METHODS = ("sac", "sac_crossq", "sac_flow", "sac_flow_plain", "sac_flow_decoder", "flowrl", "qsm")


def methods() -> list[tuple[str, float, str]]:
    """Each method's update against SAC's, in time and in operations."""
    answers = {name: together([["method_step", name]], pinned=True)[0] for name in METHODS}
    sac, rows = answers["sac"], []
    for name, answer in answers.items():
        work = answer["operations"] / sac["operations"]
        rate = answer["operations"] / answer["seconds"] / 1e9
        print(f"  {name}: {1e3 * answer['seconds']:.1f} ms, {answer['operations'] / 1e9:.2f} GFLOP", end=", ")
        print(f"{rate:.0f} GFLOP/s")
        rows.append((f"update of {name} / sac, time", answer["seconds"] / sac["seconds"], f"~ {work:.2f}"))
    return rows


def pool() -> list[tuple[str, float, str]]:
    """The pool against cores times one bare environment, the package's and ours."""
    answer = _one("pool_rate")
    print(f"  bare {answer['package']:.0f} steps/s, ours {answer['ours']:.0f};", end=" ")
    print(f"pool {answer['pool']:.0f} on {answer['cores']} cores")
    return [
        ("pool / (cores x one bare environment of the package)", answer["pool_to_package"], ">= 0.85"),
        ("pool / (cores x one bare environment of ours)", answer["pool_to_ours"], "-"),
        ("a step of Meta-World / ours, time", answer["quicker"], "-"),
    ]


def training() -> list[tuple[str, float, str]]:
    """Two seeds of ours against two runs of a peer, one a core, whole training."""
    rates = {}
    for name, command in {
        "hcpg_flow": ["ours", "hcpg_flow"],
        "SBX SAC": ["peer", "SAC"],
        "SBX CrossQ": ["peer", "CrossQ"],
        "hcpg_flow again": ["ours", "hcpg_flow"],
    }.items():
        answers = together([[*command, "0"], [*command, "1"]], pinned=True)
        rates[name] = sum(answer["steps_per_s"] for answer in answers)
        print(f"  {name}: {rates[name]:.0f} environment steps/s over two runs")
    ours = (rates["hcpg_flow"] + rates["hcpg_flow again"]) / 2
    return [
        ("whole training, ours / SBX SAC", ours / rates["SBX SAC"], ">= 1.0"),
        ("whole training, ours / SBX CrossQ", ours / rates["SBX CrossQ"], ">= 1.3"),
    ]


def selection() -> list[tuple[str, float, str]]:
    """What the selector adds to proposing four actions."""
    answer = _one("selection_cost")
    print(
        f"  propose {answer['propose_us']:.0f} us, with selection {answer['with_selection_us']:.0f} us;",
        end=" ",
    )
    print(f"NumPy's selection alone {answer['numpy_us']:.0f} us")
    return [
        ("selection / propose, K=4, time", answer["share"], "< 0.05"),
        ("the same for the 8 environments of a tick", answer["share_of_a_tick"], "< 0.05"),
    ]


def memory() -> list[tuple[str, float, str]]:
    """Peak memory of the demo's two runs, workers included, over its first evaluation."""
    command = [sys.executable, "scripts/demo.py", "--budget.steps", "8000", "--budget.evaluations", "1"]
    process = subprocess.Popen(command, cwd=ROOT, env=ENVIRONMENT, stdout=subprocess.DEVNULL)
    peak = 0.0
    while process.poll() is None:
        peak = max(peak, _proportional_bytes(process.pid))
        time.sleep(0.5)
    if process.returncode:
        raise SystemExit("benchmark failed: the demo ended with an error")
    return [("memory of the demo at its peak, GiB", peak / 2**30, "< 2")]


def maniskill_stepping() -> list[tuple[str, float, str]]:
    """Our steps of ManiSkill's tasks against its own behind CPUGymWrapper, resets apart and included."""
    print(
        f"  mani-skill {version('mani-skill')}, torch {version('torch')}; times of the processor, one thread"
    )
    rows = []
    for answer in _one("maniskill_stepping"):
        name = f"{answer['task']}, {answer['mode']}"
        print(
            f"  {name}: {answer['stock_step_us']:.0f} us a step, ours {answer['our_step_us']:.0f};", end=" "
        )
        print(
            f"{answer['our_reset_us']:.0f} us a reset; numbers differ by {answer['largest_difference']:.0e}"
        )
        rows.append((f"{name}: a step of ManiSkill / ours, time", answer["ratio"], ">= 2"))
        rows.append((f"{name}: the same with resets", answer["episode_ratio"], ">= 2"))
    return rows


def _proportional_bytes(pid: int) -> float:
    """Memory of a process and all its children; a shared page counts once (PSS)."""
    import psutil

    total = 0
    for process in [psutil.Process(pid), *psutil.Process(pid).children(recursive=True)]:
        try:
            total += process.memory_full_info().pss
        except (psutil.NoSuchProcess, psutil.AccessDenied):
            continue  # it ended while we were looking
    return total


def report() -> list[tuple[str, float, str]]:
    """Reading, summing up and writing the page of 10,000 runs, just generated."""
    answer = _one("report_scale")
    print(f"  {answer['runs']:,} runs, {answer['episodes_gib']:.2f} GiB of episodes;", end=" ")
    print(f"{answer['processor_seconds']:.1f} s of one core, page {answer['page_mib']:.1f} MiB")
    return [
        ("hcpg report on 10,000 runs, s", answer["seconds"], "< 20"),
        ("memory of it at its peak, GiB", answer["peak_gib"], "< 1"),
    ]


def _one(module: str) -> Any:
    command = [sys.executable, "-m", f"benchmarks.{module}"]
    answer = subprocess.run(command, cwd=ROOT, env=ENVIRONMENT, check=True, capture_output=True, text=True)
    return json.loads(answer.stdout.strip().splitlines()[-1])


PARTS = {
    part.__name__: part
    for part in (gradient_steps, methods, pool, training, selection, memory, maniskill_stepping, report)
}


def main() -> None:
    """Run the parts asked for, then print one table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("parts", nargs="*", choices=[*PARTS, []], help="default: all")
    rows = []
    print(f"{this_machine()}\n")
    for name in parser.parse_args().parts or PARTS:
        print(f"{name} ...", flush=True)
        rows += PARTS[name]()
    width = max(len(label) for label, _, _ in rows)
    print(f"\n{'measured in this run':<{width}}  ratio  wanted")
    for label, ratio, wanted in rows:
        print(f"{label:<{width}}  {ratio:5.2f}  {wanted}")


if __name__ == "__main__":
    main()
