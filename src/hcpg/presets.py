"""The paper's method-and-selector pairs and the budgets, as values; and the settings of a run."""

from dataclasses import asdict, dataclass, field, replace
from typing import Any

from hcpg import registry
from hcpg.interfaces import Valued
from hcpg.selection import RULES, Selector


class UnservedSelectorError(ValueError):
    """A selector that asks a method for what it does not have."""

    def __init__(self, method: str, rule: str) -> None:
        others = ", ".join(name for name, each in RULES.items() if not each.needs_values)
        super().__init__(
            f"the selector {rule!r} ranks proposals by a critic's value, and the method {method!r} has no "
            f"critic (its METHOD defines no `value`). Choose another method or one of: {others}."
        )


@dataclass(frozen=True)
class Budget:
    """How much data, learning and evaluation one run gets."""

    name: str
    """Name of the preset; every result carries it."""
    steps: int
    """Environment steps of one run, over all its environments."""
    environments: int
    """Environments of one run, stepped together."""
    updates_per_step: float
    """Critic updates per environment step."""
    warmup_steps: int
    """First environment steps, with uniform actions that bypass the selector."""
    batch_size: int
    """Transitions per update."""
    evaluations: int
    """Evaluations of one run, evenly spaced; the last one comes at the end."""
    evaluation_episodes: int
    """Episodes per evaluation, each run with the selector and bare; one start state each."""
    replay_capacity: int = 1_000_000
    """Transitions kept; the oldest are overwritten."""
    training_horizon: int | None = None
    """Steps after which a training episode is cut, which bootstraps, if the task's own limit is not sooner.

    Evaluation always has the task's own limit; None leaves it to training, too.
    """


@dataclass(frozen=True)
class Settings:
    """Everything that decides what a run computes, the seed apart."""

    task: str
    """Task as suite/name; `hcpg list` shows them."""
    preset: str
    """Name of the method-and-selector pair; the run folder and the plots carry it."""
    method: str
    """Learning method: a file under `hcpg/methods`."""
    learner: Any
    """The method's own settings."""
    selector: Selector
    """What chooses among the proposals while training data is collected."""
    evaluation_selector: Selector
    """What chooses among the proposals at evaluation; the bare actor is evaluated beside it.

    With one candidate there is nothing to choose, and the bare actor is all that is evaluated.
    """
    adapter: str
    """Family of the task's scene reader: `paper` or `contact`; never mixed in one table."""
    budget: Budget
    """Data, learning and evaluation."""

    def as_json(self) -> dict[str, Any]:
        """Plain values for `config.json`, the same for equal settings."""
        return asdict(self)


PARTS = ("learner", "selector", "evaluation_selector", "budget")
"""The nested settings, each value of which has an option of its own."""


@dataclass(frozen=True)
class Preset:
    """A method and the selector it acts with."""

    method: str
    selector: Selector
    learner: dict[str, Any] = field(default_factory=dict)
    """The method's settings where they differ from its defaults, at every budget."""
    overrides: dict[str, dict[str, Any]] = field(default_factory=dict)
    """Further ones, which go before `learner`: by budget, and by budget and suite as `cpu/maniskill`."""
    evaluation_selector: Selector | None = None
    """The selector at evaluation, where it is another one."""


# Chosen by measurement, see docs/decisions.md: with few updates the actor must learn faster than in the
# official recipe, a high target entropy and a temperature that falls slowly keep it exploring until it knows
# the better of two ways, and a shorter horizon lets the critics tell them apart early. The discount is the
# same for every method.
CPU_DISCOUNT = {"discount": 0.97}
CPU_SAC_FLOW = {
    **CPU_DISCOUNT,
    "actor_hidden_size": 256,
    "critic_hidden_size": 256,
    "actor_learning_rate": 1e-3,
    "temperature_learning_rate": 3e-4,
    "target_entropy": 24.0,
}
# But ManiSkill's dense rewards ask for a hand within a centimetre where an action can move it ten: there the
# official recipe's target and rate take the noise away in time (docs/decisions.md).
QUIETER = {"temperature_learning_rate": 1e-3, "target_entropy": 0.0}
SAC_FLOW_ON_CPU = {"cpu": CPU_SAC_FLOW, "cpu/maniskill": QUIETER}

# SAC-Flow's recipe but for the actor (and the target entropy, which is the action's here, not a path's).
SAC_CROSSQ = {
    "critic": "crossq",
    "critic_hidden_size": 1024,
    "critic_learning_rate": 1e-3,
    "temperature_learning_rate": 1e-3,
    "momentum": 0.5,
    "policy_delay": 3,
    "initial_temperature": 0.2,
}
CPU_SAC_CROSSQ = {**CPU_DISCOUNT, "critic_hidden_size": 256, "actor_learning_rate": 1e-3}

CPU_QSM = {**CPU_DISCOUNT, "actor_hidden_size": 256, "critic_hidden_size": 256}

# The critics and rates of SAC-Flow's offline-to-online code, and no more of it: there is no offline phase, no
# pull towards the data's actions and no action chunks here; the target takes the critics' minimum (there: the
# mean), critics have two ReLU layers (there: four with GELU), and the noise is learned (there: fixed).
SAC_FLOW_POLYAK = {
    "critic": "polyak",
    "critic_hidden_size": 512,
    "critic_learning_rate": 3e-4,
    "temperature_learning_rate": 3e-4,
    "momentum": 0.9,
    "policy_delay": 1,
}
# The numbers of RLinf's SAC-Flow for ManiSkill's PickCube, where settings for them exist. There it has ten
# critics (here: two), LayerNorm in the decoder (here: batch renorm), gradients clipped at 1, other bounds of
# the deviation while acting, a softplus temperature, and 32 environments with one update per step.
SAC_FLOW_RLINF = {
    "velocity": "decoder",
    "critic": "polyak",
    "critic_hidden_size": 256,
    "critic_learning_rate": 3e-4,
    "temperature_learning_rate": 3e-4,
    "momentum": 0.9,
    "discount": 0.8,
    "target_entropy": -4.0,
}

HCPG, ALONE = Selector("hcpg", candidates=4), Selector("first", candidates=1)


def _arm(selector: Selector, evaluation_selector: Selector | None = None) -> Preset:
    """SAC-Flow with another selector: a control that takes HCPG apart."""
    return Preset("sac_flow", selector, {}, SAC_FLOW_ON_CPU, evaluation_selector)


def _field(velocity: str, **cpu: Any) -> Preset:
    """SAC-Flow with another velocity field; what else is changed is said in `cpu`."""
    return Preset("sac_flow", ALONE, {"velocity": velocity}, SAC_FLOW_ON_CPU | {"cpu": CPU_SAC_FLOW | cpu})


ARMS = {
    "hcpg_k2": _arm(Selector("hcpg", candidates=2)),
    "hcpg_k8": _arm(Selector("hcpg", candidates=8)),
    "hcpg_training_only": _arm(HCPG, ALONE),
    "hcpg_evaluation_only": _arm(ALONE, HCPG),
    "hcpg_random_directions": _arm(Selector("hcpg", direction="random", candidates=4)),
    "hcpg_opposed": _arm(Selector("hcpg", direction="opposed", candidates=4)),
    "q_guided": _arm(Selector("value", candidates=4)),
    "q_guided_soft": _arm(Selector("value_soft", candidates=4)),
    "argmax": _arm(Selector("argmax", candidates=4)),
    "mean": _arm(Selector("mean", candidates=4)),
    "random": _arm(Selector("random", candidates=4)),
    "permuted": _arm(Selector("permuted", candidates=4)),
}
"""Q-guided selection and HCPG's ablations. Source: paper, the candidate-count ablation; the rest is ours."""

PRESETS = {
    "hcpg_flow": _arm(HCPG),
    "sac_flow": _arm(ALONE),
    **ARMS,
    "sac_flow_decoder": _field("decoder"),
    # As published, the plain field acts by other moments than it learns by (docs/baselines.md).
    "sac_flow_plain": _field("plain", plain_norm="per_step"),
    "sac_flow_polyak": Preset("sac_flow", ALONE, SAC_FLOW_POLYAK, SAC_FLOW_ON_CPU),
    "sac_flow_rlinf": Preset("sac_flow", ALONE, SAC_FLOW_RLINF),
    "flowrl": Preset("flowrl", ALONE, {}, {"cpu": {**CPU_DISCOUNT, "hidden_size": 256}}),
    "qsm": Preset("qsm", ALONE, {}, {"cpu": CPU_QSM}),
    "sac": Preset("sac", ALONE, {}, {"cpu": CPU_DISCOUNT}),
    "sac_crossq": Preset("sac", ALONE, SAC_CROSSQ, {"cpu": CPU_SAC_CROSSQ}),
}

# ManiSkill's rewards lie in [0, 1] (Meta-World's reach 10) and its episodes have 50 steps: the discount is
# that of its own baselines, and the temperature starts where entropy does not drown the reward
# (docs/decisions.md).
SUITES = {"maniskill": {"discount": 0.8, "initial_temperature": 0.01}}
"""The learner's settings that follow from a suite, at every budget and for every method that has them."""

BUDGETS = {
    "paper": Budget(
        "paper",
        steps=1_000_000,
        environments=1,
        updates_per_step=1.0,
        warmup_steps=50_000,
        batch_size=512,
        evaluations=25,
        evaluation_episodes=50,
    ),
    "cpu": Budget(
        "cpu",
        steps=60_000,
        environments=8,
        updates_per_step=0.5,
        warmup_steps=5_000,
        batch_size=256,
        evaluations=12,
        evaluation_episodes=20,
        replay_capacity=200_000,
    ),
}


def settings(task: str, preset: str = "hcpg_flow", budget: str = "cpu") -> Settings:
    """The full settings behind three names.

    Raises:
        UnknownNameError: the preset or the budget does not exist.
    """
    chosen = _known("preset", preset, PRESETS)
    amount = _known("budget", budget, BUDGETS)
    config = registry.method(chosen.method).Config()
    suite, changes = task.partition("/")[0], chosen.overrides
    learner = chosen.learner | changes.get(budget, {}) | changes.get(f"{budget}/{suite}", {})
    learner |= {name: value for name, value in SUITES.get(suite, {}).items() if hasattr(config, name)}
    return Settings(
        task=task,
        preset=preset,
        method=chosen.method,
        learner=replace(config, **learner),
        selector=chosen.selector,
        evaluation_selector=chosen.evaluation_selector or chosen.selector,
        adapter="paper",
        budget=amount,
    )


def refuse_unserved(settings: Settings) -> None:
    """Check that the method can serve what both selectors ask for.

    Raises:
        UnservedSelectorError: a selector ranks by value, and the method has no critic.
    """
    for selector in (settings.selector, settings.evaluation_selector):
        if selector.needs_values and not issubclass(registry.method(settings.method).METHOD, Valued):
            raise UnservedSelectorError(settings.method, selector.rule)


def _known(kind: str, name: str, table: dict[str, Any]) -> Any:
    if name not in table:
        raise registry.UnknownNameError(kind, name, sorted(table))
    return table[name]


def differences(chosen: Settings) -> list[str]:
    """The options of `hcpg train` that lead from the preset and its budget to these settings."""
    usual = settings(chosen.task, chosen.preset, chosen.budget.name)
    options = [] if chosen.adapter == usual.adapter else ["--adapter", chosen.adapter]
    for part in PARTS:
        values, usual_values = asdict(getattr(chosen, part)), asdict(getattr(usual, part))
        for name, value in values.items():
            if value != usual_values[name]:
                words = value if isinstance(value, tuple) else [value]
                options += [f"--{part}.{name}".replace("_", "-"), *map(str, words)]
    return options


def from_json(config: dict[str, Any]) -> Settings:
    """The settings that `Settings.as_json` wrote down."""
    learner = registry.method(config["method"]).Config(**config["learner"])
    return Settings(
        **{
            **config,
            "learner": learner,
            "selector": _selector(config["selector"]),
            "evaluation_selector": _selector(config["evaluation_selector"]),
            "budget": Budget(**config["budget"]),
        }
    )


def _selector(fields: dict[str, Any]) -> Selector:
    pairs = {name: tuple(value) for name, value in fields.items() if isinstance(value, list)}
    return Selector(**{**fields, **pairs})
