"""Small files are taken into the page, others are linked; of several videos the newest is shown."""

import base64

from hcpg.report.page.media import Embedding, pictures, videos
from hcpg.report.records import load_runs


def test_a_small_file_becomes_a_data_uri_and_a_large_one_a_link(tmp_path):
    (tmp_path / "a run").mkdir()
    file = tmp_path / "a run" / "x.mp4"
    file.write_bytes(b"12345678")
    embedded = Embedding(tmp_path / "report", each_bytes=8, all_bytes=12)
    assert embedded.source(file) == {
        "data": f"data:video/mp4;base64,{base64.b64encode(b'12345678').decode()}",
        "link": "../a%20run/x.mp4",
    }
    assert embedded.source(file)["data"] is None  # 4 bytes are left
    assert Embedding(tmp_path, each_bytes=7).source(file) == {"data": None, "link": "a%20run/x.mp4"}


def test_the_newest_video_of_every_selector_is_chosen(write_run, tmp_path):
    for seed, names in ((1, ["step_000000100_hcpg"]), (0, [])):
        path = write_run(seed=seed, bare=[1])
        (path / "videos").mkdir()
        names += ["step_000000100_value_soft", "step_000000200_value_soft", "mine"] * (seed == 0)
        for name in names:
            (path / "videos" / f"{name}.mp4").write_bytes(name.encode())
    found = videos(load_runs([tmp_path]), Embedding(tmp_path))
    assert [(each["selector"], each["seed"], each["name"]) for each in found] == [
        ("hcpg", 1, "step_000000100_hcpg"),
        ("mine", 0, "mine"),
        ("value_soft", 0, "step_000000200_value_soft"),
    ]


def test_figures_come_once_with_their_captions(tmp_path):
    for name in ("bars.svg", "bars.png", "bars.pdf", "strip.png"):
        (tmp_path / name).write_bytes(b"x")
    (tmp_path / "bars.caption.txt").write_text("Bars.\n\nmade by: hcpg report")
    found = pictures(sorted(tmp_path.iterdir()), Embedding(tmp_path))
    assert [(each["name"], each["caption"][:5], each["link"]) for each in found] == [
        ("bars", "Bars.", "bars.svg"),
        ("strip", "", "strip.png"),
    ]
    assert found[0]["data"].startswith("data:image/svg+xml;base64,")
