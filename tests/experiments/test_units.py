"""Which runs share a process, and what it is told."""

from tiny_cells import cell

from hcpg.commands.options import overridden
from hcpg.experiments.ledger import Entry
from hcpg.experiments.units import command, units
from hcpg.presets import settings


def begun(seed, step, tmp_path):
    folder = tmp_path / f"run{seed}"
    (folder / "checkpoints").mkdir(parents=True)
    if step is not None:
        (folder / "checkpoints" / f"step_{step:09d}").mkdir()
    return Entry(cell(seed), "stopped", folder)


def seeds(found):
    return [[each.seed for each in unit.cells] for unit in found]


def test_on_cores_every_run_is_alone_and_together_the_seeds_of_a_configuration_are_one():
    entries = [Entry(cell(seed, steps=steps), "left") for seed in (0, 1) for steps in (64, 128)]
    assert seeds(units(entries, together=False)) == [[0], [0], [1], [1]]
    found = units(entries, together=True)
    assert seeds(found) == [[0, 1], [0, 1]]
    assert [unit.settings.budget.steps for unit in found] == [64, 128]


def test_runs_are_together_only_if_they_go_on_from_the_same_step(tmp_path):
    places = [None, 32, 16, 32]
    entries = [begun(seed, step, tmp_path) for seed, step in enumerate(places)]
    entries += [Entry(cell(4), "left"), Entry(cell(5), "left")]
    found = units(entries, together=True)
    assert seeds(found) == [[0], [1, 3], [2], [4, 5]]
    assert command(found[1], tmp_path) == ["train", "--resume", *map(str, found[1].folders)]
    assert [folder.name for folder in found[1].folders] == ["run1", "run3"]


def test_the_command_of_new_runs_leads_to_their_settings(tmp_path):
    [unit] = units([Entry(cell(seed, steps=100), "left") for seed in (3, 4)], together=True)
    words = command(unit, tmp_path)
    assert words[:7] == ["train", "--task", "point/reach", "--preset", "sac", "--budget", "cpu"]
    assert words[7:12] == ["--seeds", "3", "4", "--out", str(tmp_path)]
    assert overridden(settings("point/reach", "sac"), words[12:]) == unit.settings


def test_a_unit_and_its_log_are_named_after_task_preset_and_seeds():
    [unit] = units([Entry(cell(seed), "left") for seed in (0, 2)], together=True)
    assert unit.label == "point/reach sac s0 s2"
    assert str(unit.log) == "logs/point-reach_sac_s0_s2.txt"
