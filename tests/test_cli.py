"""The command as a user meets it: answers at once, names the right word, and loses nothing when stopped."""

import json
import os
import re
import resource
import signal
import subprocess
import sys
from pathlib import Path

import psutil
import pytest

from hcpg import cli
from hcpg.loops.runs import RunFolder

VALUES = {
    "learner.flow-steps": 2,
    "learner.target-entropy": 0,
    "budget.updates-per-step": 0.5,
    "learner.actor-hidden-size": 16,
    "learner.critic-hidden-size": 16,
    "budget.environments": 4,
    "budget.warmup-steps": 40,
    "budget.batch-size": 16,
    "budget.evaluation-episodes": 4,
    "budget.replay-capacity": 1024,
    "budget.steps": 480,
    "budget.evaluations": 4,
}
TINY = [
    "--task",
    "point/reach",
    *(word for name, value in VALUES.items() for word in (f"--{name}", str(value))),
]
CACHE = Path(__file__).parents[1] / ".cache"
COMMAND = [sys.executable, "-m", "hcpg"]


def environment():
    """JAX's own cache folder is left out: a killed process could tear an entry that other tests read."""
    inherited = {name: value for name, value in os.environ.items() if name != "JAX_COMPILATION_CACHE_DIR"}
    return inherited | {"XDG_CACHE_HOME": str(CACHE)}


def command(root, *options):
    return [*COMMAND, "train", "--out", str(root), *TINY, *options]


@pytest.fixture
def start():
    """Starts a command whose lines can be read while it runs; kills it if the test does not."""
    started = []

    def begin(root, *options):
        opened = {"stdout": subprocess.PIPE, "text": True, "start_new_session": True}
        started.append(subprocess.Popen(command(root, *options), env=environment(), **opened))
        return started[-1]

    yield begin
    for process in started:
        process.kill()
        process.wait()
        process.stdout.close()


def folder_in(root):
    [manifest] = root.rglob("manifest.json")
    return RunFolder.open(manifest.parent)


def arrays(folder):
    newest = sorted(folder.checkpoints.glob("step_*"))[-1]
    files = json.loads((newest / "facts.json").read_text())["files"]
    return newest.name, {name: file["sha256"] for name, file in files.items()}


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """One run that nobody disturbed: its folder and what the command printed."""
    root = tmp_path_factory.mktemp("trained")
    printed = subprocess.check_output(command(root), env=environment(), text=True)
    return folder_in(root), printed


def test_help_takes_less_than_half_a_second():
    used = []
    for _ in range(3):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        printed = subprocess.check_output([*COMMAND, "--help"], text=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        used.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    assert min(used) < 0.5
    assert all(f"\n  {name} " in printed for name in cli.COMMANDS)


def test_without_a_command_help_is_shown(capsys):
    assert cli.main([]) == 0
    assert capsys.readouterr().out.startswith("usage: hcpg COMMAND")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["trian"], "no command is named 'trian'. Did you mean 'train'?"),
        (["train", "--task", "point/rech"], "no task is named 'point/rech'. Did you mean 'point/reach'?"),
        (["train", *TINY, "--seed", "1"], "there is no option --seed. Did you mean --seeds?"),
        (
            ["train", *TINY, "--preset", "hcpg_flo"],
            "no preset is named 'hcpg_flo'. Did you mean 'hcpg_flow'?",
        ),
        (["train", *TINY, "--learner.target-entrop", "4"], "--learner.target-entropy FLOAT"),
        (["train", *TINY, "--selector.candidates", "0"], "candidates is 0; it must lie in [1, 1e+06]"),
        (["train", *TINY, "--budget.warmup-steps", "8"], "warmup_steps 8 must fill a batch of 16"),
        (["train", *TINY, "--adapter", "papre"], "no adapter is named 'papre'. Did you mean 'paper'?"),
        (["train", *TINY, "--seeds", "1", "1"], "named twice"),
        (["train", "--resume", "nowhere"], "there is nothing at nowhere. Name a run folder"),
        (["train"], "give --task for new runs, or --resume RUN"),
        (["evaluate", "nowhere"], "there is nothing at nowhere. Name a run folder"),
    ],
)
def test_a_wrong_word_stops_with_the_right_one(arguments, message, capsys):
    try:
        code = cli.main(arguments)
    except SystemExit as stop:
        code = stop.code
    captured = capsys.readouterr()
    printed = re.sub(r"[│╭╮╰╯─\s]+", " ", captured.out + captured.err)
    assert code == 2
    assert message in printed
    assert "Traceback" not in printed


def test_an_unknown_error_keeps_its_traceback(monkeypatch):
    monkeypatch.setattr("hcpg.commands.list.run", lambda arguments: [][1])
    with pytest.raises(IndexError):
        cli.main(["list"])


def test_a_reader_that_leaves_early_is_no_error():
    with subprocess.Popen([*COMMAND, "list"], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as run:
        run.stdout.close()
        assert run.stderr.read() == b""
    assert run.returncode == 141


def test_list_names_what_there_is(capsys):
    assert cli.main(["list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert "  bare        the method's own action, without a selector" in lines
    described = dict(
        line.split(maxsplit=1) for line in lines if line.startswith("  hcpg_") or " alone" in line
    )
    assert described["hcpg_flow"] == "sac_flow with selector hcpg (K = 4)"
    assert described["hcpg_opposed"] == "sac_flow with selector hcpg (K = 4, opposed directions)"
    assert described["hcpg_training_only"] == "sac_flow with selector hcpg (K = 4), evaluated alone"
    assert described["qsm"] == "qsm alone"
    assert described["sac_flow_rlinf"] == "sac_flow alone, velocity decoder, critic polyak"
    assert any(line.startswith("  point/carry ") for line in lines)
    assert any(line.startswith("  twin    The digital twin of a Franka arm") for line in lines)


def test_plain_lines_where_nobody_watches(trained):
    folder, printed = trained
    lines = printed.splitlines()
    assert lines[0].startswith("point/reach: budget cpu, 480 steps per run")
    assert [line.split(":")[1] for line in lines if "evaluation at" in line] == [
        f" evaluation at step {step}" for step in (120, 240, 360, 480)
    ]
    assert lines[-2:] == ["hcpg_flow s0: finished at step 480", f"hcpg_flow s0  finished  {folder.path}"]
    assert "\x1b" not in printed


def test_evaluate_repeats_the_recorded_evaluation(trained, capsys, monkeypatch):
    monkeypatch.setattr(os, "environ", os.environ.copy())
    folder, _ = trained
    assert cli.main(["evaluate", str(folder.path), "--episodes", "4"]) == 0
    [file] = (folder.path / "evaluations").iterdir()
    assert file.name == "step_000000480_hcpg-k4_paper_4.jsonl"
    recorded = [row for row in folder.rows("episodes") if row["phase"] == "evaluation" and row["step"] == 480]
    assert [json.loads(line) for line in file.read_text().splitlines()] == recorded
    successes = sum(row["success_once"] for row in recorded if row["selector"] == "bare")
    bare = next(line for line in capsys.readouterr().out.splitlines() if line.startswith("bare"))
    assert f"({successes}/4)" in bare


def test_evaluate_takes_a_checkpoint_and_any_selector(trained, capsys, monkeypatch):
    monkeypatch.setattr(os, "environ", os.environ.copy())
    folder, _ = trained
    older = folder.checkpoints / "step_000000360"
    assert cli.main(["evaluate", str(older), "--selector", "first", "--episodes", "3"]) == 0
    printed = capsys.readouterr().out
    assert printed.startswith("point/reach, hcpg_flow s0 at step 360, adapter paper\n")
    assert "start states 0 to 2 of the evaluation's set (seed 1000003)" in printed
    assert (folder.path / "evaluations" / "step_000000360_first-k4_paper_3.jsonl").exists()


def test_play_writes_a_video(trained, capsys, monkeypatch):
    monkeypatch.setattr(os, "environ", os.environ.copy())
    folder, _ = trained
    assert cli.main(["play", str(folder.path), "--episodes", "2", "--selector", "bare"]) == 0
    told = capsys.readouterr().out
    file = folder.videos / "step_000000480_bare.mp4"
    assert told.startswith(f"{file} (")
    count = f"import imageio_ffmpeg; print(*imageio_ffmpeg.count_frames_and_secs({str(file)!r}))"
    frames, seconds = map(float, subprocess.check_output([sys.executable, "-c", count]).split())
    # An episode has the first picture and one after each of its 60 steps but the last, which resets.
    failures = told.count("no success")
    assert 60 * failures < frames <= 120 if failures < 2 else frames == 120
    assert seconds == pytest.approx(frames / 25, abs=0.05)


def test_a_resume_under_another_configuration_is_refused(trained, capsys):
    folder, _ = trained
    assert cli.main(["train", "--resume", str(folder.path), "--learner.discount", "0.9"]) == 2
    assert "learner.discount: 0.97 in the run, 0.9 asked for" in capsys.readouterr().err


def processes_of(process):
    """The command's process and everything it started."""
    parent = psutil.Process(process.pid)
    return [parent, *parent.children(recursive=True)]


def test_killed_at_any_moment_it_goes_on_as_if_nothing_had_been(trained, start, tmp_path):
    process = start(tmp_path)
    for line in process.stdout:
        if "evaluation at step 120" in line:
            break
    family = processes_of(process)
    assert len(family) >= 3  # the command, the run, its environments
    process.kill()
    process.communicate()
    _, alive = psutil.wait_procs(family[1:], timeout=120)
    assert alive == []
    folder = folder_in(tmp_path)
    assert folder.status()["state"] in ("stopped", "finished")
    subprocess.run([*COMMAND, "train", "--resume", str(folder.path)], env=environment(), check=True)
    assert arrays(folder) == arrays(trained[0])
    assert folder.rows("episodes") == trained[0].rows("episodes")


def read_until(process, word):
    """What the command printed up to the first line with that word."""
    printed = ""
    while word not in printed:
        line = process.stdout.readline()
        assert line, printed
        printed += line
    return printed


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_stop_saves_and_says_how_to_go_on(start, tmp_path, number, code):
    process = start(tmp_path, "--budget.steps", "8000")
    printed = read_until(process, "steps/s")
    send = os.killpg if number == signal.SIGINT else os.kill  # a terminal sends Ctrl-C to the whole group
    send(process.pid, number)
    printed += process.communicate(timeout=120)[0]
    assert process.returncode == code
    folder = folder_in(tmp_path)
    status = folder.status()
    assert status["state"] == "stopped"
    assert arrays(folder)[0] == f"step_{status['step']:09d}"
    assert f"go on with: hcpg train --resume {folder.path}" in printed


def test_a_second_ctrl_c_kills_at_once_and_leaves_nobody_behind(start, tmp_path):
    process = start(tmp_path, "--budget.steps", "80000", "--budget.evaluations", "1")
    read_until(process, "steps/s")
    family = processes_of(process)
    run = next(
        each for each in family[1:] if each.cpu_times().user == max(p.cpu_times().user for p in family[1:])
    )
    run.suspend()  # it cannot obey the first request
    os.killpg(process.pid, signal.SIGINT)
    read_until(process, "once more kills at once")
    os.killpg(process.pid, signal.SIGINT)
    printed = process.communicate(timeout=60)[0]
    assert process.returncode == 130
    assert "SIGKILL" in printed
    assert psutil.wait_procs(family, timeout=60)[1] == []
