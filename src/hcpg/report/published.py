"""The paper's own numbers, to stand beside ours: last-five success in percent, mean and sample SD over seeds.

Source: paper, tables of Meta-World and ManiSkill success and of the sensitivity to the candidate count.
"""

from hcpg.report.statistics import Spread

_PRESETS = ("sac", "flowrl", "qsm", "sac_flow", "hcpg_flow")
_METAWORLD = {
    "button-press": ((82.0, 13.2), (78.0, 8.4), (94.5, 5.2), (82.5, 8.2), (91.9, 2.3)),
    "drawer-open": ((55.1, 48.9), (65.3, 56.6), (33.3, 57.7), (100.0, 0.0), (99.9, 0.2)),
    "door-open": ((99.9, 0.2), (99.5, 0.6), (100.0, 0.0), (100.0, 0.0), (99.9, 0.2)),
    "sweep-into": ((83.9, 8.5), (83.1, 14.0), (51.7, 46.0), (92.3, 3.6), (93.7, 6.7)),
    "peg-insert-side": ((79.7, 31.7), (64.8, 56.1), (99.9, 0.2), (98.1, 2.6), (99.1, 1.0)),
    "lever-pull": ((55.9, 46.7), (93.2, 8.4), (64.9, 38.9), (95.1, 1.8), (98.4, 2.4)),
}
_MANISKILL = {
    "pick-cube": {
        "flowrl": (1.6, 1.4),
        "sac_flow": (57.5, 14.2),
        "hcpg_k2": (42.5, 13.5),
        "hcpg_flow": (91.7, 8.8),
        "hcpg_k8": (46.2, 15.7),
    },
    "push-cube": {
        "flowrl": (99.9, 0.2),
        "sac_flow": (96.7, 2.9),
        "hcpg_k2": (100.0, 0.0),
        "hcpg_flow": (98.8, 1.3),
        "hcpg_k8": (98.8, 1.3),
    },
    "poke-cube": {"flowrl": (96.8, 1.6), "sac_flow": (96.2, 3.3), "hcpg_flow": (96.7, 1.4)},
    "pull-cube": {
        "flowrl": (99.9, 0.2),
        "sac_flow": (98.3, 1.9),
        "hcpg_k2": (100.0, 0.0),
        "hcpg_flow": (99.6, 0.7),
        "hcpg_k8": (97.5, 2.2),
    },
}

PUBLISHED = {
    (f"metaworld/{task}", preset): Spread(*cell)
    for task, row in _METAWORLD.items()
    for preset, cell in zip(_PRESETS, row, strict=True)
} | {
    (f"maniskill/{task}", preset): Spread(*cell)
    for task, row in _MANISKILL.items()
    for preset, cell in row.items()
}
"""By task and preset; what the paper does not have is not there."""
