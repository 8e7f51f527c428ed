import time

from hcpg.safety.clock import MachineClock


def test_it_is_the_machines_and_never_wakes_early():
    clock = MachineClock()
    due_s = time.perf_counter() + 0.005
    clock.sleep_until(due_s)
    assert due_s <= clock.now_s() <= time.perf_counter()
    before_s = clock.now_s()
    clock.sleep_until(before_s - 1.0)
    assert clock.now_s() - before_s < 1.0
