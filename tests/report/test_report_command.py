"""`hcpg report`: the files it writes, and what it refuses."""

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
    assert files == {"table.md", "table.tex", "table.csv", *pictures}
    assert all(str(file) in told for file in (root / "report").iterdir())


def test_a_folder_without_runs_is_refused(tmp_path, capsys):
    assert cli.main(["report", str(tmp_path)]) == 2
    assert "no evaluated run under" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
