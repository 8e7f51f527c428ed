"""What results must have alike before they stand in one table or one comparison."""

from collections.abc import Iterable, Mapping, Sequence

from hcpg.report.dotted import dotted
from hcpg.report.records import Group, RecordError


def shared(facts: Iterable[tuple[str, Mapping[str, str]]]) -> dict[str, str]:
    """The facts that all have alike, from pairs of a name and its facts.

    Raises:
        RecordError: they differ; the message has what differs, with the names.
    """
    seen: dict[str, dict[str, list[str]]] = {}
    owners_of = list(facts)
    for name in dict.fromkeys(name for _, each in owners_of for name in each):
        for owner, each in owners_of:
            seen.setdefault(name, {}).setdefault(each.get(name, "absent"), []).append(owner)
    for name, values in seen.items():
        if len(values) > 1:
            text = "; ".join(f"{value}: {', '.join(owners)}" for value, owners in values.items())
            raise RecordError(f"cannot mix {name} ({text}). Report them apart, or finish the runs.")
    return {name: next(iter(values)) for name, values in seen.items()}


def one_protocol(groups: Sequence[Group]) -> dict[str, str]:
    """What all runs of a table have alike: budget, steps, adapter, evaluation episodes, seeds.

    Raises:
        RecordError: they differ in one of these, or in any value of the budget; the message has what differs,
            with the presets.
    """
    shared((_name(group), dotted({"budget": group.runs[0].config["budget"]})) for group in groups)
    return shared((_name(group), protocol(group)) for group in groups)


def protocol(group: Group) -> dict[str, str]:
    """The facts of one group that those beside it must have too.

    Raises:
        RecordError: its seeds have no evaluation in common, or differ in their settings.
    """
    curve = group.curve(group.selector)
    if curve is None or not curve.steps.size:
        raise RecordError(f"{_name(group)}: its seeds have no evaluation in common. Train on.")
    distinct = {id(run.config): run for run in group.runs}  # runs share the object of equal settings
    shared((run.name, dotted(run.config)) for run in distinct.values())
    return {
        "budget": group.runs[0].config["budget"]["name"],
        "steps": f"{curve.steps[-1]:,}",
        "adapter": ", ".join(sorted({run.adapter for run in group.runs})),
        "evaluation episodes": ", ".join(map(str, sorted(set(curve.episodes.ravel().tolist())))),
        "seeds": " ".join(str(run.seed) for run in group.runs),
    }


def _name(group: Group) -> str:
    return f"{group.preset} on {group.task}"
