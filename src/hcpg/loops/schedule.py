"""When things happen in a run: updates per tick, evaluations, log rows. Counts of environment steps."""

from dataclasses import dataclass
from math import ceil, isclose

from hcpg.presets import Budget

LOG_ROWS = 100
"""Rows of metrics per run, about."""


class BudgetError(ValueError):
    """A budget that cannot be carried out; the message says what to change."""


@dataclass(frozen=True)
class Schedule:
    """A budget in ticks; one tick is one step of all E environments of a run."""

    budget: Budget
    updates_per_tick: int
    ticks_per_update: int
    """Ticks between learning calls; above 1 only if a tick is worth less than one update."""

    @classmethod
    def of(cls, budget: Budget, horizon: int) -> "Schedule":
        """The schedule of a budget.

        Raises:
            BudgetError: a number is out of range, or does not divide as the loop needs it.
        """
        _check_ranges(budget, horizon)
        per_tick = budget.updates_per_step * budget.environments
        updates, pause = max(1, round(per_tick)), max(1, round(1 / per_tick))
        if not isclose(updates / pause, per_tick, rel_tol=1e-9):
            raise BudgetError(
                f"updates_per_step {budget.updates_per_step} times {budget.environments} environments is "
                f"{per_tick:g} updates per tick; it must be a whole number or one over a whole number. "
                f"Nearest: updates_per_step {updates / pause / budget.environments:g}."
            )
        return cls(budget, updates, pause)

    def learns(self, tick: int) -> bool:
        """Whether the learner runs during this tick (0 is the first)."""
        warm = tick * self.budget.environments >= self.budget.warmup_steps
        return warm and tick % self.ticks_per_update == 0

    def explores(self, tick: int) -> bool:
        """Whether this tick's actions are the uniform ones of the warm-up."""
        return tick * self.budget.environments < self.budget.warmup_steps

    def ticks(self) -> int:
        """Ticks of the whole run."""
        return ceil(self.budget.steps / self.budget.environments)

    def evaluates(self, tick: int) -> bool:
        """Whether an evaluation follows tick number `tick` (1 after the first tick)."""
        return tick in {ceil(self.ticks() * k / self.budget.evaluations) for k in self._evaluations()}

    def logs(self, tick: int) -> bool:
        """Whether a row of metrics is written after tick number `tick`."""
        return tick % max(1, self.ticks() // LOG_ROWS) == 0

    def _evaluations(self) -> range:
        return range(1, self.budget.evaluations + 1)


def _check_ranges(budget: Budget, horizon: int) -> None:
    environments = budget.environments
    wrong = [
        (budget.steps < 1, f"steps {budget.steps} must be at least 1"),
        (environments < 1, f"environments {environments} must be at least 1"),
        (not budget.updates_per_step > 0, f"updates_per_step {budget.updates_per_step} must be positive"),
        (budget.batch_size < 1, f"batch_size {budget.batch_size} must be at least 1"),
        (budget.evaluations < 1, f"evaluations {budget.evaluations} must be at least 1"),
        (
            budget.evaluation_episodes < 1,
            f"evaluation_episodes {budget.evaluation_episodes} must be at least 1",
        ),
        (
            budget.training_horizon is not None and budget.training_horizon < 1,
            f"training_horizon {budget.training_horizon} must be at least 1",
        ),
        (
            environments >= 1 and budget.evaluations > max(1, ceil(budget.steps / environments)),
            f"evaluations {budget.evaluations} must be at most one per step of {environments} environments",
        ),
        (
            budget.warmup_steps < budget.batch_size,
            f"warmup_steps {budget.warmup_steps} must fill a batch of {budget.batch_size}",
        ),
        (
            environments >= 1 and budget.replay_capacity % environments != 0,
            f"replay_capacity {budget.replay_capacity} must be a multiple of {environments} environments",
        ),
        (
            budget.replay_capacity < environments * horizon,
            f"replay_capacity {budget.replay_capacity} must hold one episode of each environment, "
            f"{environments * horizon} transitions, for a resume to find them",
        ),
    ]
    found = [message for is_wrong, message in wrong if is_wrong]
    if found:
        raise BudgetError("budget: " + "; ".join(found) + ".")
