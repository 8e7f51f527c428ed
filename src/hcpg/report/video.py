"""Frames to an mp4 file that any player and browser shows."""

import warnings
from collections.abc import Generator, Iterable
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from hcpg.report.extras import require
from hcpg.types import UInt8


def write_video(frames: Iterable[UInt8[np.ndarray, "H W 3"]], path: Path, fps: int) -> Path:
    """Write `frames` (RGB, all of one size) to `path`; the file appears once it is complete.

    An odd height or width is extended by one pixel, because the format wants even ones.

    Raises:
        MissingExtraError: imageio-ffmpeg is not installed.
        ValueError: no frames, or frames of different sizes.
    """
    require("imageio_ffmpeg", "video")
    import imageio_ffmpeg

    frames = iter(frames)
    first = next(frames, None)
    if first is None:
        raise ValueError(f"no frames for {path}: render at least one")
    height, width = _even(first).shape[:2]
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_name(f".{path.stem}.writing.mp4")
    writer = imageio_ffmpeg.write_frames(beside, (width, height), fps=fps, macro_block_size=2)
    _start(writer)
    for number, frame in enumerate(chain([first], frames)):
        if frame.shape != first.shape:
            writer.close()
            beside.unlink()
            raise ValueError(f"frame {number} has shape {frame.shape}, the first has {first.shape}")
        writer.send(np.ascontiguousarray(_even(frame)))
    writer.close()
    return beside.rename(path)


def _start(writer: Generator[None, Any, None]) -> None:
    """Start the encoder. JAX warns of any fork from its threads; this one only executes another program."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", r"os\.fork\(\) was called", RuntimeWarning)
        writer.send(None)


def _even(frame: UInt8[np.ndarray, "H W 3"]) -> UInt8[np.ndarray, "evenH evenW 3"]:
    height, width = frame.shape[:2]
    return np.pad(frame, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")
