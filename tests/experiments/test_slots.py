"""Cores and shares of cards, and that nobody gets one twice."""

import pytest

from hcpg.experiments import slots


@pytest.fixture(autouse=True)
def own_folder(tmp_path, monkeypatch):
    monkeypatch.setattr(slots, "own_folder", lambda: tmp_path)


def test_a_core_is_one_slot_and_goes_to_one_job_at_a_time():
    first, second = slots.core_slots([0, 3])
    assert [(each.name, each.cores) for each in (first, second)] == [("core 0", {0}), ("core 3", {3})]
    assert first.variables == {"JAX_PLATFORMS": "cpu"}
    lock = first.take()
    assert slots.core_slots([0])[0].take() is None
    second.take().close()
    lock.close()
    slots.core_slots([0])[0].take().close()


def test_a_whole_card_is_a_slot_with_its_part_of_the_cores():
    found = slots.card_slots(["0", "1"], 1.0, [0, 1, 2, 3, 4])
    assert [each.name for each in found] == ["card 0", "card 1"]
    assert [each.cores for each in found] == [{0, 2, 4}, {1, 3}]
    assert found[1].variables == {"CUDA_VISIBLE_DEVICES": "1", "XLA_PYTHON_CLIENT_MEM_FRACTION": "0.75"}


def test_a_card_is_shared_by_fraction():
    found = slots.card_slots(["2"], 0.3, [0, 1])
    assert [each.name for each in found] == ["card 2 part 0", "card 2 part 1", "card 2 part 2"]
    assert [each.cores for each in found] == [{0}, {1}, {0, 1}]
    assert {each.variables["XLA_PYTHON_CLIENT_MEM_FRACTION"] for each in found} == {"0.25"}
    assert {each.variables["CUDA_VISIBLE_DEVICES"] for each in found} == {"2"}


def test_the_cards_are_those_that_jax_sees_by_their_own_names(monkeypatch):
    monkeypatch.setattr(slots, "_COUNT_DEVICES", "print(3)")
    monkeypatch.delenv("CUDA_VISIBLE_DEVICES", raising=False)
    assert slots.cards() == ["0", "1", "2"]
    monkeypatch.setenv("CUDA_VISIBLE_DEVICES", "4, 6")
    assert slots.cards() == ["4", "6"]
