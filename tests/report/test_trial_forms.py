"""The table of trials as text: what it says, and that a twin is called a twin everywhere."""

import csv
import io

import pytest
from trial_studies import attempt, paper_studies, write_study

from hcpg import cli
from hcpg.report.trial_figure import trial_figure
from hcpg.report.trial_files import write_figure, write_tables
from hcpg.report.trial_forms import as_csv, caption, contrasts_csv, latex, markdown
from hcpg.report.trial_records import find_studies
from hcpg.report.trial_table import trial_table


@pytest.fixture(scope="module")
def studies(tmp_path_factory):
    return find_studies(paper_studies(tmp_path_factory.mktemp("trials")))


@pytest.fixture(scope="module")
def table(studies):
    return trial_table(studies)


def test_markdown_has_a_row_per_policy_and_task(table, studies):
    text = markdown(table, studies)
    cells = [
        [cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines() if "|" in line
    ]
    assert ["RugbyGrasp", "HCPG-Flow", "14/15", "93.3", "70.2 to 98.8", "43.0 ± 0.0", "53.5"] in cells
    assert ["Overall", "SAC-Flow", "25/30", "83.3", "66.4 to 92.7", "45.0", "68.3"] in cells
    assert ["RugbyGrasp", "SAC-Flow - HCPG-Flow", "-26.7", "-52.2 to +2.8", "0.169"] in cells
    assert "Labels that disagree: 0 of 60 trials." in text
    assert "Invalid attempts: 0." in text
    assert f"PegInsertion {studies[0].digest[:12]}" in text


def test_every_form_says_twin_and_an_arm_s_says_real(table, tmp_path):
    assert caption(table).startswith("Trials (twin, served over the arm's own protocol; no arm moved).")
    assert latex(table).splitlines()[0].startswith("% Trials (twin")
    assert {row["kind"] for row in csv.DictReader(io.StringIO(as_csv(table)))} == {"twin"}
    write_study(tmp_path / "a", "point/reach", {"ours": [5]}, kind="real")
    assert caption(trial_table(find_studies(tmp_path))).startswith("Trials (real; an arm moved).")


def test_csv_is_not_rounded(table):
    rows = list(csv.DictReader(io.StringIO(as_csv(table))))
    assert len(rows) == 6
    [ours] = [row for row in rows if (row["task"], row["policy"]) == ("franka/rugby-grasp", "hcpg_flow")]
    assert (ours["successes"], ours["trials"], ours["cap"]) == ("14", "15", "200")
    assert float(ours["steps_failures_at_cap"]) == pytest.approx(802 / 15, rel=1e-12)
    assert len(list(csv.DictReader(io.StringIO(contrasts_csv(table))))) == 3


def test_latex_is_two_tabulars_with_a_rule_between_tasks(table):
    text = latex(table)
    assert text.count(r"\begin{tabular}") == 2
    assert text.count(r"\midrule") == 3 + 1
    assert r"RugbyGrasp & SAC-Flow & 10/15 & 66.7 & 41.7 to 84.8 & 60.0 ± 0.0 & 106.7 \\" in text
    assert r" & HCPG-Flow & 14/15 & 93.3" in text


def test_disagreements_and_invalid_trials_are_listed(tmp_path):
    folder = write_study(tmp_path / "a", "point/reach", {"ours": [5]})
    rows = [
        *attempt(2, "ours", 1, -1, referee=True),
        *attempt(3, "ours", 2, -1, invalid="the camera was lost"),
    ]
    write_study(tmp_path / "b", "point/carry", {"ours": [5]}, extra=rows)
    studies = find_studies(tmp_path)
    text = markdown(trial_table(studies), studies)
    assert "- Carry, trial 2 (ours, start 1): detector: not done, physics: done" in text
    assert "Labels that disagree: 1 of 3 trials." in text
    assert "- Carry, trial 3, attempt 1 (ours): the camera was lost" in text
    assert folder.exists()


def test_missing_trials_are_said(tmp_path):
    write_study(tmp_path / "a", "point/reach", {"ours": [5, 6], "theirs": [7]})
    studies = find_studies(tmp_path)
    assert "| 1/1 (of 2 planned) |" in markdown(trial_table(studies), studies)


def test_files_carry_the_command(tmp_path):
    root = paper_studies(tmp_path / "trials")
    text, files = write_tables(find_studies(root), tmp_path / "out", "hcpg robot trials --report trials")
    assert [file.name for file in files] == ["trials.md", "trials.tex", "trials.csv", "trial_differences.csv"]
    assert files[0].read_text() == text
    assert text.endswith("made by: hcpg robot trials --report trials\n")


def test_the_figure_s_marks_are_the_table_s_numbers_and_it_says_twin(table, studies, tmp_path):
    figure = trial_figure(table)
    rates, steps = figure.axes
    [sac, ours] = [line.get_ydata() for line in rates.get_lines() if len(line.get_ydata()) == 2][::3]
    assert sorted([*sac, *ours]) == pytest.approx([200 / 3, 280 / 3, 100, 100])
    assert figure.get_suptitle() == "Trials: twin, served over the arm's own protocol"
    assert [label.get_text() for label in steps.get_xticklabels()] == ["PegInsertion", "RugbyGrasp"]
    files = write_figure(studies, tmp_path, "a command")
    assert {file.name for file in files} == {"trials.png", "trials.svg", "trials.pdf", "trials.caption.txt"}
    assert "Trials (twin" in (tmp_path / "trials.caption.txt").read_text()


def test_hcpg_report_writes_the_trials_beside_its_tables(write_run, capsys):
    root = write_run(preset="sac", bare=[1, 2, 3, 4, 5]).parents[4]
    paper_studies(root / "trials")
    assert cli.main(["report", str(root), "--no-figures"]) == 0
    told = capsys.readouterr().out
    for name in ("trials.md", "trials.tex", "trials.csv", "trial_differences.csv"):
        assert str(root / "report" / name) in told
    assert (root / "report/trials.md").read_text().startswith("Trials (twin")
