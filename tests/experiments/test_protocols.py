"""The tables as data: what they ask for exists, and everybody gets the same."""

import pytest

from hcpg.commands.options import check
from hcpg.experiments.protocols import METAWORLD, PROTOCOLS, protocol
from hcpg.registry import UnknownNameError


@pytest.mark.parametrize("name", PROTOCOLS)
def test_every_run_of_a_protocol_could_be_trained(name):
    for settings in protocol(name).settings():
        check(settings)


@pytest.mark.parametrize("name", PROTOCOLS)
def test_all_methods_of_a_table_get_the_same_budget_adapter_and_seeds(name):
    cells = protocol(name).cells()
    assert len({cell.settings.budget for cell in cells}) == 1
    assert {cell.settings.adapter for cell in cells} == {"paper"}
    seeds = {}
    for cell in cells:
        seeds.setdefault((cell.settings.task, cell.settings.preset), []).append(cell.seed)
    assert set(map(tuple, seeds.values())) == {protocol(name).seeds}


def test_the_main_table_is_the_papers():
    cells = protocol("metaworld_paper").cells()
    assert len(METAWORLD) == 6
    assert {cell.settings.task for cell in cells} == set(METAWORLD)
    assert {cell.settings.preset for cell in cells} == {"sac", "flowrl", "qsm", "sac_flow", "hcpg_flow"}
    assert {cell.seed for cell in cells} == {0, 1, 2}
    assert cells[0].settings.budget.name == "paper"


def test_an_unknown_experiment_lists_the_known_ones():
    with pytest.raises(UnknownNameError, match=r"'metawrld'\. Did you mean 'metaworld'\?.*smoke"):
        protocol("metawrld")
