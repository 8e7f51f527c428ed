"""A video read back with ffmpeg has the frames that were written."""

import subprocess
import sys

import imageio_ffmpeg
import jax
import numpy as np
import pytest

from hcpg.report.extras import MissingExtraError
from hcpg.report.video import write_video


def grey_frames(count, height=48, width=64):
    return (np.full((height, width, 3), 20 * number, np.uint8) for number in range(count))


def read_back(path, height=48, width=64):
    ffmpeg = imageio_ffmpeg.get_ffmpeg_exe()
    command = [ffmpeg, "-i", str(path), "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    done = subprocess.run(command, capture_output=True, check=True)
    return np.frombuffer(done.stdout, np.uint8).reshape(-1, height, width, 3), done.stderr.decode()


def test_frames_come_back_in_order(tmp_path):
    path = write_video(grey_frames(10), tmp_path / "videos" / "policy.mp4", fps=20)
    frames, facts = read_back(path)
    assert "20 fps" in facts
    assert "h264" in facts
    assert len(frames) == 10
    for number, frame in enumerate(frames):
        assert abs(float(frame.mean()) - 20 * number) < 6
    assert [file.name for file in path.parent.iterdir()] == ["policy.mp4"]


def test_odd_sizes_grow_by_one_pixel(tmp_path):
    frames, facts = read_back(write_video(grey_frames(3, 47, 63), tmp_path / "odd.mp4", fps=10))
    assert "64x48" in facts
    assert len(frames) == 3


def test_what_makes_no_video_is_an_error(tmp_path, monkeypatch):
    with pytest.raises(ValueError, match="no frames"):
        write_video(iter(()), tmp_path / "a.mp4", fps=10)
    mixed = [*grey_frames(2), *grey_frames(1, 50, 64)]
    with pytest.raises(ValueError, match=r"frame 2 has shape \(50, 64, 3\), the first has \(48, 64, 3\)"):
        write_video(mixed, tmp_path / "a.mp4", fps=10)
    assert not list(tmp_path.iterdir())
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(MissingExtraError, match=r"imageio_ffmpeg is not .*'hcpg-flow\[video\]'"):
        write_video(grey_frames(2), tmp_path / "a.mp4", fps=10)


def test_it_starts_its_encoder_in_silence_beside_jax(tmp_path):
    jax.block_until_ready(jax.numpy.zeros(3) + 1)  # JAX's threads run, and it warns of forks from now on
    frames = [np.zeros((16, 16, 3), np.uint8)] * 3
    assert write_video(frames, tmp_path / "video.mp4", fps=10).stat().st_size > 0
