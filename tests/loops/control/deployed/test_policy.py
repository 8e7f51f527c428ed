"""Acting with NumPy and safetensors alone, and a folder that is not as it was written."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from exported_runs import a_run

from hcpg.loops.control.choosing import Chooser
from hcpg.loops.control.deployed import Policy, PolicyFolderError, __main__, parcel
from hcpg.loops.control.deployed.timing import latency
from hcpg.loops.exporting import export
from hcpg.registry import UnknownNameError
from hcpg.selection import select
from hcpg.tasks.point.reach import read_scene

SOURCE = Path(__file__).parents[4] / "src"
OBSERVATION = np.linspace(-0.2, 0.3, 11).astype(np.float32)


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    root = tmp_path_factory.mktemp("exported")
    return export(a_run(root / "runs", actor_hidden_size=8, critic_hidden_size=8), root / "policy").folder


@pytest.fixture
def folder(exported, tmp_path):
    """A copy that a test may damage."""
    return Path(shutil.copytree(exported, tmp_path / "policy"))


def refused(folder, match):
    with pytest.raises(PolicyFolderError, match=match):
        Policy.load(folder)


def resealed(folder, change):
    """Alter `policy.json` as somebody would who writes the manifest anew."""
    facts = json.loads((folder / "policy.json").read_text())
    change(facts)
    arrays, card = parcel.read(folder).arrays, (folder / "README.md").read_text()
    shutil.rmtree(folder)
    return parcel.write(folder, facts, arrays, card)


def test_it_acts_by_selecting_among_its_proposals(exported):
    policy = Policy.load(exported)
    proposals = policy.propose(OBSERVATION, 4, np.random.default_rng(7))
    expected, _ = select(proposals, read_scene(OBSERVATION), "hcpg")
    np.testing.assert_array_equal(policy.act(OBSERVATION, np.random.default_rng(7)), expected)


def test_the_control_loop_takes_it_as_it_is(exported):
    policy = Policy.load(exported)
    chooser = Chooser(policy.proposer(3), policy.selector, read_scene, policy.action_size, 0)
    chosen = chooser.choose(OBSERVATION, 12, alone=False)
    assert chosen.unfit == ""
    proposals = policy.propose(OBSERVATION, 4, np.random.default_rng([3, 12]))
    np.testing.assert_array_equal(chosen.proposals, proposals)


def test_an_observation_of_another_size_is_refused(exported):
    with pytest.raises(ValueError, match=r"shape \(10,\); the policy reads \(11,\), as point/reach has it"):
        Policy.load(exported).act(OBSERVATION[1:], np.random.default_rng(0))


@pytest.mark.parametrize("name", ["weights.safetensors", "policy.json", "README.md", "manifest.json"])
def test_one_altered_byte_of_any_file_is_refused(folder, name):
    content = bytearray((folder / name).read_bytes())
    content[len(content) // 2] ^= 1
    (folder / name).write_bytes(content)
    refused(folder, f"{name} (was altered|is damaged)")


@pytest.mark.parametrize("name", ["weights.safetensors", "policy.json", "README.md", "manifest.json"])
def test_a_file_cut_short_is_refused(folder, name):
    content = (folder / name).read_bytes()
    (folder / name).write_bytes(content[:-20])
    refused(folder, f"{name} (has {len(content) - 20} bytes instead of {len(content)}|is damaged)")


@pytest.mark.parametrize("name", ["weights.safetensors", "policy.json", "README.md"])
def test_a_renamed_file_is_refused(folder, name):
    (folder / name).rename(folder / f"other_{name}")
    refused(folder, f"lacks {name}; there are .*other_{name}")


def test_a_renamed_manifest_is_refused(folder):
    (folder / "manifest.json").rename(folder / "manifest.txt")
    refused(folder, r"is no exported policy: it has no manifest\.json")


def test_two_files_in_each_others_place_are_refused(folder):
    (folder / "policy.json").rename(folder / "x")
    (folder / "README.md").rename(folder / "policy.json")
    (folder / "x").rename(folder / "README.md")
    refused(folder, r"policy\.json has \d+ bytes instead of")


def test_a_folder_written_anew_by_another_is_refused_by_its_digest(folder):
    digest = Policy.load(folder).digest
    forged = resealed(folder, lambda facts: facts["origin"].update(preset="forged"))
    assert Policy.load(folder).digest == forged != digest
    with pytest.raises(PolicyFolderError, match="another policy"):
        Policy.load(folder, digest)


def test_another_format_is_refused(folder, monkeypatch):
    monkeypatch.setattr(parcel, "FORMAT", 2)
    refused(folder, "has format 1, and this version reads format 2")


def test_what_this_version_does_not_know_is_named(folder):
    resealed(folder, lambda facts: facts.update(adapter="sonar"))
    with pytest.raises(UnknownNameError, match="no adapter is named 'sonar'"):
        Policy.load(folder)
    resealed(folder, lambda facts: facts.update(adapter="paper", selector={"rule": "hcpg", "mood": 1}))
    refused(folder, "unknown settings: mood")
    resealed(folder, lambda facts: facts["network"].update(kind="transformer"))
    refused(folder, "this version runs gated, plain, decoder, gaussian")
    resealed(folder, lambda facts: facts.pop("task"))
    refused(folder, "does not say task")


def test_a_computer_that_calculates_otherwise_is_refused(folder):
    # As if its arithmetic were wrong: the norms' epsilon is 0.1 there, not 0.001.
    resealed(folder, lambda facts: facts["network"].update(norm_epsilon=0.1))
    refused(folder, "differently from the trained one")


PROGRAM = """
import sys

blocked = ["array_api_compat", "beartype", "equinox", "jax", "jaxlib", "jaxtyping", "optax", "scipy", "torch"]
sys.modules.update(dict.fromkeys(blocked))  # a name that maps to None cannot be imported
folder, opened, executed = sys.argv[1], set(), []

def watch(event, arguments):
    if event == "open" and str(arguments[0]).startswith(folder):
        opened.add((str(arguments[0])[len(folder) + 1:], arguments[1]))
    if event in ("marshal.loads", "pickle.find_class", "ctypes.dlopen") or (
        event == "exec" and folder in arguments[0].co_filename
    ):
        executed.append(event)

import numpy as np
import hcpg.loops.control.deployed as deployed
from hcpg import registry
registry.task("point/reach")
sys.addaudithook(watch)
policy = deployed.Policy.load(folder)
print(*policy.act(np.linspace(-0.2, 0.3, 11), np.random.default_rng(7)))
print(sorted(opened), executed)
foreign = {name.partition(".")[0] for name in sys.modules} - set(sys.stdlib_module_names) - set(blocked)
print(*sorted(name for name in foreign if not name.startswith("_")))
"""


@pytest.fixture(scope="module")
def bare_packages(tmp_path_factory):
    """A folder with NumPy and safetensors, and nothing else that is installed here."""
    import numpy
    import safetensors

    folder = tmp_path_factory.mktemp("packages")
    for package in (numpy, safetensors):
        place = Path(package.__file__).parent
        (folder / place.name).symlink_to(place)
        libraries = place.with_name(f"{place.name}.libs")
        if libraries.exists():
            (folder / libraries.name).symlink_to(libraries)
    return os.pathsep.join([str(SOURCE), str(folder)])


def without_jax(packages, *words, folder=None):
    # -S leaves installed packages aside.
    environment = {"PYTHONPATH": packages, "PATH": os.environ["PATH"], "OPENBLAS_NUM_THREADS": "1"}
    command = [sys.executable, "-S", *words]
    return subprocess.run(command, env=environment, cwd=folder, capture_output=True, text=True, check=False)


def test_it_runs_with_numpy_and_safetensors_alone_and_only_reads_its_folder(folder, bare_packages):
    (folder / "policy.py").write_text("raise SystemExit('executed')")  # code that nobody asked for
    done = without_jax(bare_packages, "-c", PROGRAM, str(folder))
    assert done.stderr == ""
    action, touched, packages = done.stdout.splitlines()
    here = Policy.load(folder).act(np.linspace(-0.2, 0.3, 11), np.random.default_rng(7))
    np.testing.assert_allclose([float(number) for number in action.split()], here, atol=1e-6)
    names = ["README.md", "manifest.json", "policy.json", "weights.safetensors"]
    assert touched == f"{[(name, 'r') for name in names]} []"
    # NumPy brings along the runtime of the compiler that built it.
    assert set(packages.split()) - {"cython_runtime"} == {"hcpg", "numpy", "safetensors"}


def test_its_command_times_it_without_jax(exported, bare_packages, tmp_path):
    command = ["-m", "hcpg.loops.control.deployed", str(exported), "--seconds", "0.2"]
    done = without_jax(bare_packages, *command, folder=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    said = done.stdout.splitlines()
    assert said[0] == "point/reach, adapter paper, gated network, hcpg (K = 4)"
    assert said[3].startswith("7 actions at 30 Hz: p50 ")


def test_its_command_refuses_a_damaged_folder(folder, capsys):
    (folder / "README.md").write_text("mine")
    assert __main__.main([str(folder)]) == 2
    assert "README.md has 4 bytes instead of" in capsys.readouterr().err


class SlowClock:
    """Every look at it takes 1 ms."""

    def __init__(self):
        self.now = 0.0

    def now_s(self):
        self.now += 0.001
        return self.now

    def sleep_until(self, time_s):
        self.now = max(self.now, time_s)


def test_latency_is_what_the_clock_says(exported):
    found = latency(Policy.load(exported), 1.0, SlowClock())
    # From the look before an action to the one after it passes 1 ms; ticks 0 to 30 begin within a second.
    assert (found.calls, found.p50_ms, found.p99_ms) == (31, pytest.approx(1.0), pytest.approx(1.0))
    assert found.timing.skipped == 0


def test_a_policy_that_was_exported_long_ago_still_acts_as_it_did():
    policy = Policy.load(Path(__file__).parents[4] / "docs/evidence/export/policy")
    assert policy.facts["origin"]["step"] == 4000
    assert policy.deviation < 1e-6
