"""The ablation's tables: the paper's averages over task-seed runs, and who belongs into them."""

import json

import pytest

from hcpg.report.ablation import ablated, ablation, candidate_table
from hcpg.report.ablation_tables import as_csv, files, latex, markdown
from hcpg.report.booktabs import booktabs
from hcpg.report.records import load_runs


@pytest.fixture
def groups(tmp_path, write_run):
    """Two tasks and two seeds; HCPG K=8 lacks a task, and SAC has no selector."""
    rates = {"sac_flow": 5, "hcpg_k2": 6, "hcpg_flow": 9}
    for seed in (0, 1):
        for preset, rate in rates.items():
            for task, more in (("pick-cube", 0), ("push-cube", 1)):
                success = [rate + more - seed] * 6
                write_run(preset=preset, seed=seed, task=f"maniskill/{task}", success=success, bare=[0] * 6)
        write_run(preset="hcpg_k8", seed=seed, task="maniskill/pick-cube", success=[10] * 6, bare=[0] * 6)
        write_run(preset="sac", seed=seed, task="maniskill/pick-cube", bare=[0] * 6)
        write_run(preset="sac_flow", seed=seed, task="maniskill/poke-cube", bare=[0] * 6)
    return load_runs([tmp_path])


def test_other_methods_and_tasks_without_an_arm_stay_out(groups):
    found = ablation(ablated(groups))
    assert [variant.preset for variant in found.variants] == ["sac_flow", "hcpg_k2", "hcpg_flow", "hcpg_k8"]
    assert found.tasks == ["maniskill/pick-cube", "maniskill/push-cube"]
    assert ablated([group for group in groups if group.preset in ("sac", "sac_flow", "hcpg_flow")]) == []


def test_an_arm_that_selects_in_training_alone_belongs_to_it(groups, write_run, tmp_path):
    for seed in (0, 1):
        path = write_run(preset="hcpg_training_only", seed=seed, task="maniskill/pick-cube", bare=[1] * 6)
        config = {"budget": {"name": "cpu"}, "selector": {"rule": "hcpg", "candidates": 4}}
        (path / "config.json").write_text(json.dumps(config))
    presets = {group.preset for group in ablated(load_runs([tmp_path]))}
    assert presets == {"sac_flow", "hcpg_k2", "hcpg_flow", "hcpg_k8", "hcpg_training_only"}


def test_numbers_are_means_over_the_task_seed_runs(groups):
    by_preset = {variant.preset: variant for variant in ablation(ablated(groups)).variants}
    # SAC-Flow: 50 and 60 on the two tasks with seed 0, 10 less with seed 1.
    for metric in ("Last-5", "AUC", "Final"):
        assert by_preset["sac_flow"].seeds[metric] == pytest.approx([55, 45])
    assert (by_preset["sac_flow"].runs, by_preset["hcpg_k8"].runs) == (4, 2)
    # It was run on one task of two: a mean of it would compare unlike things.
    assert by_preset["hcpg_k8"].seeds == {}


def test_the_tables_have_runs_best_and_absent(groups):
    found = ablation(ablated(groups))
    lines = latex(found).splitlines()
    assert r"  SAC-Flow & 4/4 & 50.0 & 50.0 & 50.0 \\" in lines
    assert r"  HCPG K=4 & 4/4 & \textbf{90.0} & \textbf{90.0} & \textbf{90.0} \\" in lines
    assert r"  HCPG K=8 & 2/4 & -- & -- & -- \\" in lines
    assert "seeds 0 1" in markdown(found)
    assert "SAC-Flow,Last-5,50.0000,7.0711,4,4,cpu" in as_csv(found)


def test_the_candidate_table_has_a_column_per_count(groups):
    table = candidate_table(groups)
    assert table.methods == ["HCPG K=2", "HCPG K=4", "HCPG K=8"]
    assert table.cells["PushCube", "HCPG K=4"].mean == pytest.approx(95)
    assert ("PushCube", "HCPG K=8") not in table.cells
    one_count = [group for group in groups if group.preset in ("sac_flow", "hcpg_k2")]
    assert candidate_table(one_count) is None


def test_files_are_written_only_where_there_is_an_arm(groups):
    assert {name.partition(".")[0] for name in files(groups)} == {"ablation", "candidates"}
    assert len(files(groups)) == 6
    assert files([group for group in groups if group.preset in ("sac", "sac_flow")]) == {}


def test_booktabs_has_a_rule_between_blocks_and_escapes():
    text = booktabs(["a_b", "c"], [[["1", "2 %"]], [["3", r"$\pm$"]]], "note")
    assert text.splitlines() == [
        "% note",
        r"\begin{tabular}{lc}",
        r"  \toprule",
        r"  a\_b & c \\",
        r"  \midrule",
        r"  1 & 2 \% \\",
        r"  \midrule",
        r"  3 & $\pm$ \\",
        r"  \bottomrule",
        r"\end{tabular}",
    ]
