"""Training is a function of the settings and the seed: stops, resumes and company change nothing."""

from dataclasses import replace

import numpy as np
import pytest
from safetensors.numpy import load_file
from tiny_runs import STEPS, checkpoint_digests, sit, tiny_settings

from hcpg.loops import sitting
from hcpg.loops.checkpoints import CheckpointError
from hcpg.loops.pool import Pool
from hcpg.loops.runs import RunFolder, RunFolderError


def arrays(folder, tree):
    [newest] = folder.checkpoints.iterdir()
    return load_file(newest / f"{tree}.safetensors")


def test_two_halves_and_a_stop_equal_one_sitting_bit_for_bit(straight, tmp_path):
    whole, _ = straight
    half = tiny_settings(steps=STEPS // 2, evaluations=1)
    [folder] = sitting.create_folders(half, [1], tmp_path)
    folder.append("episodes", [{"step": 40, "phase": "train"}])  # killed before its first checkpoint
    asked = []
    sit(half, [folder], stop=lambda: asked.append(None) or len(asked) > 17)
    assert folder.status()["state"] == "stopped"
    assert folder.status()["step"] == 17 * 4
    assert [path.name for path in folder.checkpoints.iterdir()] == ["step_000000068"]
    sit(half, [folder])
    assert folder.status() == folder.status() | {"state": "finished", "step": STEPS // 2}
    sit(sitting.extended(folder, STEPS), [folder])
    assert checkpoint_digests(folder) == checkpoint_digests(whole)
    assert folder.rows("episodes") == whole.rows("episodes")
    assert folder.config() == whole.config()


def test_a_run_in_a_population_gives_the_numbers_it_gives_alone(tmp_path):
    settings = tiny_settings(steps=100, evaluations=1)
    [alone] = sitting.create_folders(settings, [1], tmp_path)
    sit(settings, [alone])
    population = sitting.create_folders(settings, [0, 1], tmp_path)
    sit(settings, population)
    brought = [arrays(folder, "replay") for folder in (alone, *population)]
    for name in brought[0]:
        np.testing.assert_allclose(brought[2][name], brought[0][name], atol=1e-5, err_msg=name)
    learned = [arrays(folder, "state") for folder in (alone, *population)]
    # An input that never changes is taken out by its norm, whatever the scale: that entry's gradient is of
    # rounding errors alone, of which Adam makes steps of the learning rate. Here these are the height of the
    # object on the table and whether it is held, and two norms see them.
    idle = np.flatnonzero(np.ptp(brought[0]["['observations']"], axis=0) == 0)
    assert idle.tolist() == [6, 10]
    scales = {".actor.field.observation_norm.scale", ".critic.networks.norms[0].scale"}
    for name in learned[0]:
        own, beside = (
            np.delete(learned[place][name], idle, axis=-1) if name in scales else learned[place][name]
            for place in (0, 2)
        )
        np.testing.assert_allclose(beside, own, atol=1e-5, err_msg=name)
    assert scales <= learned[0].keys()
    assert max(np.abs(learned[1][name] - learned[0][name]).max() for name in learned[0]) > 0.1
    for own, beside in zip(alone.rows("episodes"), population[1].rows("episodes"), strict=True):
        near = {name: pytest.approx(own[name], rel=1e-4) for name in own if name.endswith("return")}
        if "value" in own:  # parameters differ by up to 1e-5, and it sums the effects of all
            near["value"] = pytest.approx(own["value"], abs=1e-4)
        assert beside == own | near


def test_a_run_whose_reward_is_not_finite_stops_alone(straight, tmp_path, monkeypatch):
    _, settings = straight
    receive, calls = Pool.receive, []

    def poisoned(pool):
        arrival = receive(pool)
        if pool.size == 8:  # the training pool of two runs; the evaluation's has four environments a run
            calls.append(None)
        if len(calls) == 21:
            arrival.rewards[5] = np.nan
        return arrival

    monkeypatch.setattr(Pool, "receive", poisoned)
    folders = sitting.create_folders(settings, [0, 1], tmp_path)
    events = sit(settings, folders)
    assert folders[0].status()["state"] == "finished"
    assert folders[1].status() == folders[1].status() | {
        "state": "diverged",
        "step": 84,
        "quantity": "reward",
    }
    assert [event.seed for event in events if event.kind == "evaluation"] == [0, 0]
    assert list(folders[1].checkpoints.iterdir()) == []


def test_a_training_horizon_cuts_training_episodes_and_no_others(tmp_path):
    settings = tiny_settings()
    settings = replace(settings, budget=replace(settings.budget, training_horizon=20))
    [folder] = sitting.create_folders(settings, [0], tmp_path)
    sit(settings, [folder])
    lengths = {
        phase: {row["length"] for row in folder.rows("episodes") if row["phase"] == phase}
        for phase in ("train", "evaluation")
    }
    assert lengths == {"train": {20}, "evaluation": {60}}


def test_another_configuration_is_refused(straight):
    folder, _ = straight
    with pytest.raises(RunFolderError, match=r"learner.discount: 0.97 in the run, 0.9 asked for"):
        sit(tiny_settings(discount=0.9), [folder])


def test_an_error_before_the_first_step_is_in_the_status(tmp_path, monkeypatch):
    settings = tiny_settings()
    [folder] = sitting.create_folders(settings, [0], tmp_path)

    def refuse(*_):
        raise MemoryError("no room for the replay")

    monkeypatch.setattr(sitting, "Trainer", refuse)
    with pytest.raises(MemoryError):
        sit(settings, [folder])
    assert folder.status()["state"] == "failed"
    assert folder.status()["error"] == "MemoryError: no room for the replay"


def test_a_truncated_checkpoint_is_refused_with_the_cure(straight, tmp_path):
    whole, settings = straight
    [folder] = sitting.create_folders(settings, [1], tmp_path)
    newest = folder.checkpoints / f"step_{STEPS:09d}"
    newest.mkdir()
    for file in (whole.checkpoints / newest.name).iterdir():
        (newest / file.name).write_bytes(file.read_bytes())
    with (newest / "replay.safetensors").open("r+b") as file:
        file.truncate(100)
    with pytest.raises(CheckpointError, match=r"replay.safetensors has 100 bytes.*Restore one from a copy"):
        sit(settings, [RunFolder.open(folder.path)])
