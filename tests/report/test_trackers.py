"""What trackers wrote, read back from their own files; nothing of it uses the network."""

import struct
import sys

import pytest

from hcpg.report.extras import MissingExtraError
from hcpg.report.trackers import TRACKERS, TrackedRun, Tracker

CONFIG = {"budget": {"name": "cpu"}, "learner": {"discount": 0.97}}


@pytest.fixture
def run(tmp_path):
    return TrackedRun(tmp_path, "20260101T000000Z-0a", "point/reach", "hcpg_flow", 2, CONFIG)


def scalars(folder):
    """Every (step, name, value) of the event files: records of length, checksum, content, checksum."""
    from tensorboardX.proto.event_pb2 import Event

    found = []
    for file in sorted(folder.glob("events.*")):
        content = file.read_bytes()
        while content:
            (length,) = struct.unpack("<Q", content[:8])
            event, content = Event.FromString(content[12 : 12 + length]), content[16 + length :]
            found += [(event.step, value.tag, value.simple_value) for value in event.summary.value]
    return [each for each in found if not each[1].startswith("config")]


def test_tensorboard_holds_every_number_once_also_the_second_time(run):
    for _ in range(2):
        tracker = TRACKERS["tensorboard"](run)
        assert isinstance(tracker, Tracker)
        tracker.log(100, {"train/loss": 0.5, "evaluation/hcpg/success_once": 0.25})
        tracker.log(200, {"train/loss": 0.125})
        tracker.close()
    assert scalars(run.path / "tensorboard") == [
        (100, "train/loss", 0.5),
        (100, "evaluation/hcpg/success_once", 0.25),
        (200, "train/loss", 0.125),
    ]


def offline_records(folder):
    """The file of the one offline run in `folder`, and its records.

    The file is a LevelDB log: after 7 bytes come blocks of 32 KiB with pieces of checksum, length and kind
    (1 whole, 2 first, 3 middle, 4 last).
    """
    from wandb.proto.wandb_internal_pb2 import Record

    [file] = folder.glob("wandb/offline-run-*/*.wandb")
    content, place, records, open_piece = file.read_bytes(), 7, [], b""
    while place + 7 <= len(content):
        if 32768 - place % 32768 < 7:
            place += 32768 - place % 32768
            continue
        length, kind = struct.unpack("<HB", content[place + 4 : place + 7])
        open_piece += content[place + 7 : place + 7 + length]
        place += 7 + length
        if kind in (1, 4):
            records.append(Record.FromString(open_piece))
            open_piece = b""
    return file, records


def test_wandb_is_offline_whatever_the_environment_says(run, monkeypatch):
    monkeypatch.setenv("WANDB_MODE", "online")
    monkeypatch.setenv("WANDB_ERROR_REPORTING", "true")
    for _ in range(2):
        tracker = TRACKERS["wandb"](run)
        tracker.log(100, {"train/loss": 0.5})
        tracker.log(200, {"train/loss": 0.125})
        tracker.close()
    import wandb  # not before: it is the tracker that keeps it off the network

    wandb.teardown()  # its service writes the file's end in its own time, at the latest when it ends
    file, records = offline_records(run.path)
    assert file.parent.name.startswith("offline-run-")
    started = next(record.run for record in records if record.HasField("run"))
    assert (started.run_id, started.project) == (run.id, "hcpg")
    assert started.display_name == "point/reach/hcpg_flow/s2"
    rows = [record.history.item for record in records if record.HasField("history")]
    told = [{"/".join(item.nested_key) or item.key: item.value_json for item in row} for row in rows]
    assert [row["environment_step"] for row in told] == ["100", "200"]
    assert [row["train/loss"] for row in told] == ["0.5", "0.125"]


def test_a_missing_package_is_named_with_the_cure(run, monkeypatch):
    monkeypatch.setitem(sys.modules, "tensorboardX", None)
    with pytest.raises(MissingExtraError, match=r"tensorboardX is not .*pip install 'hcpg-flow\[trackers\]'"):
        TRACKERS["tensorboard"](run)
