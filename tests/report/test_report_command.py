"""`hcpg report`: the files it writes, and what it refuses."""

import csv
import json
import re

import pytest

from hcpg import cli


def test_the_table_and_the_figures_are_written(write_run, capsys):
    path = write_run(preset="sac", bare=[1, 2, 3, 4, 5])
    root = path.parents[4]
    assert cli.main(["report", str(root)]) == 0
    told = capsys.readouterr().out
    assert "| Reach" in told
    pictures = [
        f"{name}.{kind}"
        for name in ("curves", "bars_point", "progress")
        for kind in ("png", "svg", "pdf", "caption.txt")
    ]
    files = {file.name for file in (root / "report").iterdir()}
    assert files == {"report.html", "table.md", "table.tex", "table.csv", *pictures}
    assert all(str(file) in told for file in (root / "report").iterdir())
    [row] = csv.DictReader((root / "report/table.csv").read_text().splitlines())
    assert (row["presets"], row["command"], row["budget"]) == ("sac", f"hcpg report {root}", "cpu")
    assert row["commit"] in (root / "report/table.tex").read_text()


@pytest.fixture
def many(write_run):
    """Two presets on one task, and one of them on another task with a longer training."""
    for preset in ("sac", "sac_flow"):
        path = write_run(preset=preset, bare=[1, 2, 3, 4, 5])
    write_run(preset="sac", bare=[1, 2, 3, 4, 5, 6], task="point/carry")
    return path.parents[4]


def test_mixed_protocols_are_refused_unless_the_runs_are_chosen(many, capsys):
    command = ["report", str(many), "--no-figures"]
    assert cli.main(command) == 2
    assert "cannot mix steps (600: sac on point/carry; 500: sac on point/reach" in capsys.readouterr().err
    assert cli.main([*command, "--tasks", "point/reach", "--presets", "sac_flow"]) == 0
    table = (many / "report/table.csv").read_text().splitlines()
    assert [line.split(",")[:2] for line in table] == [
        ["task", "method"],
        ["Reach", "SAC-Flow"],
    ]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--tasks", "point/reech"], "named 'point/reech'. Did you mean 'point/reach'? Known: point/carry,"),
        (["--presets", "hcpg"], "no preset is named 'hcpg'. Known: sac, sac_flow."),
        (["--presets", "sac", "--reference", "sac_flow"], "no reference is named 'sac_flow'"),
    ],
)
def test_unknown_names_list_the_known_ones(options, message, many, capsys):
    assert cli.main(["report", str(many), *options]) == 2
    assert message in capsys.readouterr().err
    assert not (many / "report").exists()


def test_a_corrupt_run_is_skipped_only_when_asked_and_the_page_says_so(write_run, capsys):
    for seed in (0, 1):
        path = write_run(preset="sac", seed=seed, bare=[1, 2, 3, 4, 5])
    root = path.parents[4]
    (path / "episodes.jsonl").write_text("garbage\n")
    command = ["report", str(root), "--no-figures"]
    assert cli.main(command) == 2
    assert "episodes.jsonl, line 1 is not JSON" in capsys.readouterr().err
    assert cli.main([*command, "--skip-corrupt"]) == 0
    assert "skipped a corrupt run: " in capsys.readouterr().err
    page = (root / "report/report.html").read_text()
    data = json.loads(re.search(r'type="application/json">(.*?)</script>', page, re.DOTALL)[1])
    assert data["protocol"]["seeds"] == "0"
    assert [notice.split(":")[0] for notice in data["notices"]] == ["skipped a corrupt run"]


def test_a_torn_last_line_is_told_and_the_rest_counts(write_run, capsys):
    path = write_run(preset="sac", bare=[1, 2, 3, 4, 5])
    with (path / "episodes.jsonl").open("a") as file:
        file.write('{"step": 600, "phase": "evalu')
    assert cli.main(["report", str(path), "--no-figures"]) == 0
    told = capsys.readouterr()
    assert "dropped a torn last line (29 bytes)" in told.err
    assert "steps 500" in told.out


def test_a_folder_without_runs_is_refused(tmp_path, capsys):
    assert cli.main(["report", str(tmp_path)]) == 2
    assert "no evaluated run under" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
