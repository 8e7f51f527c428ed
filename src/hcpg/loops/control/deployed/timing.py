"""How long an exported policy takes for an action, at the pace of the control loop."""

from typing import NamedTuple

import numpy as np

from hcpg.interfaces import Clock
from hcpg.loops.control.deadlines import Deadlines, Timing
from hcpg.loops.control.deployed.policy import TOLERANCE, Policy

RATE_HZ = 30.0


class Latency(NamedTuple):
    """What acting took."""

    calls: int
    p50_ms: float
    p99_ms: float
    max_ms: float
    timing: Timing
    """How the deadlines were kept meanwhile."""


def latency(policy: Policy, seconds: float, clock: Clock) -> Latency:
    """Act at 30 Hz for so long, on an observation of the training; at least once."""
    deadlines, random = Deadlines(clock, RATE_HZ), np.random.default_rng(0)
    took_s: list[float] = []
    end_s = clock.now_s() + seconds
    while not took_s or clock.now_s() < end_s:
        deadlines.wait()
        begin_s = clock.now_s()
        policy.act(policy.probe, random)
        took_s.append(clock.now_s() - begin_s)
    p50, p99 = (1000 * float(np.percentile(took_s, share)) for share in (50, 99))
    return Latency(len(took_s), p50, p99, 1000 * max(took_s), deadlines.timing())


def described(policy: Policy) -> list[str]:
    """What the policy is, as plain lines."""
    selector, kind = policy.selector, policy.facts["network"]["kind"]
    chooses = "alone" if selector.alone else f"{selector.rule} (K = {selector.candidates})"
    return [
        f"{policy.task}, adapter {policy.adapter}, {kind} network, {chooses}",
        f"at most {policy.deviation:.1e} from what the trained network did (allowed: {TOLERANCE:g})",
        f"sha256 {policy.digest}",
    ]


def measured(found: Latency) -> list[str]:
    """What acting took, as plain lines."""
    timing = found.timing
    late = (timing.lateness_p50_ms, timing.lateness_p99_ms, timing.lateness_max_ms)
    return [
        f"{found.calls} actions at {RATE_HZ:g} Hz: p50 {found.p50_ms:.3f}, p99 {found.p99_ms:.3f}, "
        f"max {found.max_ms:.3f} ms each",
        "woken late by p50 {:.3f}, p99 {:.3f}, max {:.3f} ms".format(*late)
        + f"; {timing.skipped} deadlines missed",
    ]
