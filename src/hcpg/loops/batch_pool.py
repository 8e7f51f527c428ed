"""A pool whose environments are one batch, stepped in this process by one simulator on the accelerator.

All begin and end their episodes together, at the time limit: no task of a batched suite ends by itself.
"""

from collections.abc import Sequence

import jax
import numpy as np

from hcpg import registry
from hcpg.interfaces import BatchedSuite, EnvironmentBatch
from hcpg.loops.pool import Arrival, Pool
from hcpg.types import Float, Int, Tensor, UInt8


class BatchPool(Pool):
    """N environments of one task in one batch; observations are arrays of JAX's wherever they lie."""

    exact = False

    def __init__(self, batch: EnvironmentBatch, task: str, size: int, horizon: int | None = None) -> None:
        """Take over a batch; episodes are cut after `horizon` steps, by default where the task says."""
        address = registry.task(task)
        self.spec = registry.suite(address.suite).spec(address)
        self.size, self._task, self._batch = size, task, batch
        self._horizon, self._age = horizon or address.horizon, 0
        self._sent: tuple[np.ndarray, np.ndarray] | None = None

    def reset(self, starts: Int[np.ndarray, " N"]) -> Float[Tensor, "N O"]:
        """The first observations of the given start states."""
        self._age = 0
        return self._batch.reset(starts)

    def send(self, actions: Float[np.ndarray, "N A"], next_starts: Int[np.ndarray, " N"]) -> None:
        """Keep one action per environment until `receive`: what learns in between has the accelerator alone.

        Raises:
            ValueError: the actions are not N x A.
        """
        shape = (self.size, self.spec.action_size)
        if actions.shape != shape:
            raise ValueError(f"actions have the shape {actions.shape}; {self._task} needs {shape}")
        self._sent = (np.asarray(actions), np.asarray(next_starts))

    def receive(self) -> Arrival:
        """What the actions last sent bring.

        Raises:
            RuntimeError: nothing was sent.
        """
        if self._sent is None:
            raise RuntimeError("receive() without send(): there is nothing to wait for")
        (actions, next_starts), self._sent = self._sent, None
        last, rewards, success = self._batch.step(actions)
        self._age += 1
        ends = self._age == self._horizon
        observations = self.reset(next_starts) if ends else last
        nobody = np.zeros(self.size, bool)
        rewards, success = np.asarray(rewards, np.float32), np.asarray(success, bool)
        return Arrival(observations, last, rewards, nobody, np.full(self.size, ends), success)

    def restore(
        self, starts: Int[np.ndarray, " N"], actions: Sequence[Float[np.ndarray, "_ A"]]
    ) -> Float[Tensor, "N O"]:
        """The observations after each start state and its own actions, as many for each environment.

        On a GPU these are not the ones that the same actions once led to: its sums have no fixed order.
        """
        observations = self.reset(starts)
        for action in np.stack(actions, axis=1):
            observations, _, _ = self._batch.step(action)
            self._age += 1
        return observations

    def render(self, environment: int) -> UInt8[np.ndarray, "H W 3"]:
        """Refused.

        Raises:
            RuntimeError: a batch has nothing to draw with.
        """
        raise RuntimeError("a batch draws nothing; make a Pool of one environment for pictures")

    def close(self) -> None:
        """Free the simulator; safe to call twice."""
        self._batch.close()


def open_pool(task: str, seeds: Sequence[int], *, workers: int, horizon: int | None = None) -> Pool:
    """One environment per seed: in one batch where JAX has an accelerator and the suite can make one.

    Otherwise in worker processes. Arguments and errors are those of `Pool`.
    """
    address = registry.task(task)
    suite = registry.suite(address.suite)
    if isinstance(suite, BatchedSuite) and jax.default_backend() != "cpu":
        return BatchPool(suite.make_batch(address, list(seeds)), task, len(seeds), horizon)
    return Pool(task, seeds, workers=workers, horizon=horizon)
