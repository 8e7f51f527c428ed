"""What travels between machines: only what is new, and always so that a run can be resumed."""

import shutil

import pytest
from tiny_cells import cell

from hcpg.experiments.parcels import Parcel, land, pack
from hcpg.loops.runs import RunFolder


@pytest.fixture
def run(tmp_path):
    """A run with one checkpoint, in a results folder of its own, with a log beside it."""
    settings = cell(0).settings
    folder = RunFolder.create(
        tmp_path / "far", task="point/reach", preset="sac", seed=0, config=settings.as_json(), manifest={}
    )
    folder.append("metrics", [{"step": 8, "wall_s": 1.0}])
    checkpoint(folder, 8)
    log = tmp_path / "far/logs/one.txt"
    log.parent.mkdir()
    log.write_text("began\n")
    return folder


def checkpoint(folder, step):
    made = folder.checkpoints / f"step_{step:09d}"
    made.mkdir()
    for name in ("facts.json", "state.safetensors"):
        (made / name).write_text(f"{name} {step}")


def logs(tmp_path):
    return [tmp_path / "far/logs/one.txt"]


def contents(root):
    hidden = {"lock"}
    files = (path for path in root.rglob("*") if path.is_file() and path.name not in hidden)
    return {str(path.relative_to(root)): path.read_bytes() for path in files}


def test_a_run_arrives_as_it_was_and_can_be_opened(run, tmp_path):
    with run.lock():
        parcel = pack(tmp_path / "far", [run.path], logs(tmp_path), {})
    land(parcel, tmp_path / "here")
    assert contents(tmp_path / "here") == contents(tmp_path / "far")
    arrived = RunFolder.open(tmp_path / "here" / run.path.relative_to(tmp_path / "far"))
    assert arrived.rows("metrics") == [{"step": 8, "wall_s": 1.0}]
    assert arrived.config() == run.config()


def test_only_what_has_changed_is_sent_again_and_old_checkpoints_go(run, tmp_path):
    sent = {}
    land(pack(tmp_path / "far", [run.path], logs(tmp_path), sent), tmp_path / "here")
    assert pack(tmp_path / "far", [run.path], logs(tmp_path), sent).files == {}
    run.append("metrics", [{"step": 16, "wall_s": 2.0}])
    checkpoint(run, 16)
    shutil.rmtree(run.checkpoints / "step_000000008")
    parcel = pack(tmp_path / "far", [run.path], logs(tmp_path), sent)
    where = str(run.path.relative_to(tmp_path / "far"))
    assert sorted(name.removeprefix(f"{where}/") for name in parcel.files) == [
        "checkpoints/step_000000016/facts.json",
        "checkpoints/step_000000016/state.safetensors",
        "metrics.jsonl",
    ]
    land(parcel, tmp_path / "here")
    assert contents(tmp_path / "here") == contents(tmp_path / "far")


def test_a_checkpoint_that_is_deleted_while_it_is_read_is_left_out(run, tmp_path, monkeypatch):
    sent = {}
    checkpoint(run, 16)
    read = type(run.path).read_bytes

    def deleted(path):
        shutil.rmtree(run.checkpoints / "step_000000008", ignore_errors=True)
        return read(path)

    monkeypatch.setattr(type(run.path), "read_bytes", deleted)
    parcel = pack(tmp_path / "far", [run.path], logs(tmp_path), sent)
    [kept] = parcel.checkpoints.values()
    assert kept == ["step_000000016"]
    assert not any("step_000000008" in name for name in (*parcel.files, *sent))


def test_a_landing_that_was_cut_short_is_made_good_by_the_next(run, tmp_path):
    parcel = pack(tmp_path / "far", [run.path], logs(tmp_path), {})
    [where] = parcel.checkpoints
    half = Parcel({f"{where}/config.json": parcel.files[f"{where}/config.json"]}, {})
    arriving = tmp_path / "here" / where
    arriving = arriving.with_name(f".arriving-{arriving.name}")
    (arriving / "checkpoints/.arriving-step_000000008").mkdir(parents=True)
    (arriving / "config.json").write_bytes(half.files[f"{where}/config.json"])
    land(parcel, tmp_path / "here")
    assert contents(tmp_path / "here") == contents(tmp_path / "far")
    assert not arriving.exists()


def test_the_tables_land_before_the_checkpoint_that_they_must_reach(run, tmp_path, monkeypatch):
    parcel = pack(tmp_path / "far", [run.path], logs(tmp_path), {})

    def fails(parts, target):
        raise OSError("the disk is full")

    monkeypatch.setattr("hcpg.experiments.parcels._land_checkpoint", fails)
    with pytest.raises(OSError, match="the disk is full"):
        land(parcel, tmp_path / "here")
    [rows] = (tmp_path / "here").rglob("metrics.jsonl")
    assert b'"step": 8' in rows.read_bytes()
    assert not list((tmp_path / "here").rglob("step_*"))
