"""A run's numbers for TensorBoard or Weights & Biases: mirrors of its JSON lines, which stay what counts."""

import os
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple, Protocol, runtime_checkable

from hcpg.report.dotted import dotted
from hcpg.report.extras import require

STEP = "environment_step"
PROJECT = "hcpg"
FLUSH_S = 5
"""How old TensorBoard's picture of a running run may be."""


class TrackedRun(NamedTuple):
    """What a tracker is told about the run as a whole."""

    path: Path
    """Its folder."""
    id: str
    task: str
    preset: str
    seed: int
    config: Mapping[str, Any]

    @property
    def name(self) -> str:
        """Task, preset and seed."""
        return f"{self.task}/{self.preset}/s{self.seed}"


@runtime_checkable
class Tracker(Protocol):
    """Something that takes a run's numbers."""

    def log(self, step: int, values: Mapping[str, float]) -> None:
        """Take the numbers of one environment step; steps come in order, each once."""
        ...

    def close(self) -> None:
        """All is told; what is left is written out."""
        ...


class TensorBoard:
    """Event files in `tensorboard/` of the run folder, written anew so that they never hold a step twice."""

    def __init__(self, run: TrackedRun) -> None:
        """Begin them.

        Raises:
            MissingExtraError: tensorboardX is not installed.
        """
        require("tensorboardX", "trackers")
        from tensorboardX import SummaryWriter

        folder = run.path / "tensorboard"
        shutil.rmtree(folder, ignore_errors=True)
        self._writer = SummaryWriter(str(folder), flush_secs=FLUSH_S)
        settings = "\n".join(f"    {key}: {value}" for key, value in dotted(run.config).items())
        self._writer.add_text("config", settings, 0)

    def log(self, step: int, values: Mapping[str, float]) -> None:
        """Write one scalar per value."""
        for name, value in values.items():
            self._writer.add_scalar(name, value, step)

    def close(self) -> None:
        """Write out what is left."""
        self._writer.close()


class WeightsAndBiases:
    """A W&B run with the run's own id: offline in `wandb/` of the run folder, or online where asked for."""

    def __init__(self, run: TrackedRun, online: bool = False) -> None:
        """Begin it. Offline it is written anew, and `wandb sync` sends it; online a run of that id goes on.

        Raises:
            MissingExtraError: wandb is not installed.
        """
        require("wandb", "trackers")
        # Before the import: wandb would report its own errors over the network, offline too.
        os.environ["WANDB_ERROR_REPORTING"] = "true" if online else "false"
        import wandb

        if not online:
            shutil.rmtree(run.path / "wandb", ignore_errors=True)
        self._run = wandb.init(
            project=PROJECT,
            id=run.id,
            name=run.name,
            group=f"{run.task}/{run.preset}",
            config=dict(run.config),
            dir=run.path,
            mode="online" if online else "offline",
            resume="allow" if online else None,
            reinit="create_new",
            settings=wandb.Settings(console="off", silent=True, x_disable_stats=True),
        )
        self._run.define_metric(STEP)
        self._run.define_metric("*", step_metric=STEP)
        self._sent = int(self._run.summary.get(STEP, -1)) if online else -1

    def log(self, step: int, values: Mapping[str, float]) -> None:
        """Add one row; a step that was sent before a resume is not sent again."""
        if step > self._sent:
            self._run.log({STEP: step, **values})

    def close(self) -> None:
        """Write out what is left; online, wait until it is sent."""
        self._run.finish()


def _online(run: TrackedRun) -> WeightsAndBiases:
    return WeightsAndBiases(run, online=True)


TRACKERS: Mapping[str, Callable[[TrackedRun], Tracker]] = {
    "tensorboard": TensorBoard,
    "wandb": WeightsAndBiases,
    "wandb-online": _online,
}
"""By the name on the command line; only the last one uses the network."""
PACKAGES = {"tensorboard": "tensorboardX", "wandb": "wandb", "wandb-online": "wandb"}
"""What each of them needs."""
