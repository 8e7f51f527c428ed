"""The recording for the Rerun viewer, opened by its own library."""

import numpy as np
import pytest
from rollout_cases import rollout

from hcpg.report.rerun_file import UNIT_M, RerunFile

NUMBERS = {
    "selector/weights",
    "selector/scores",
    "selector/phase",
    "selector/spread",
    "selector/blend_gap",
    "selector/effective_candidates",
    "distance_m/approach",
    "distance_m/task",
    "episode/reward",
    "episode/success",
    "episode/start",
}
WORLD = {f"world/{name}" for name in ("tool", "object", "goal", "target", "proposals", "action")}


@pytest.fixture(scope="module")
def chunks(tmp_path_factory):
    """Every chunk of one recorded episode, by entity."""
    from rerun.chunk import RrdReader

    path = tmp_path_factory.mktemp("rerun") / "out.rrd"
    file, episode = RerunFile(path, "a title"), rollout()
    for moment in episode.moments:
        file.add(moment, episode)
    file.close()
    [recording] = RrdReader(path).recordings()
    assert recording.application_id == "hcpg play"
    found = {}
    for chunk in RrdReader(path).stream().to_chunks():
        found.setdefault(chunk.entity_path.removeprefix("/"), []).append(chunk.to_record_batch())
    return found


def column(chunks, entity, component):
    """One component over time, joined over chunks."""
    return [
        value
        for batch in chunks[entity]
        for name, values in zip(batch.schema.names, batch.columns, strict=True)
        if name.endswith(component)
        for value in values.to_pylist()
    ]


def test_every_entity_is_there(chunks):
    assert NUMBERS | WORLD | {"video", "about"} <= set(chunks)
    assert len(column(chunks, "video", "blob")) == 6


def test_numbers_are_those_of_the_episode(chunks):
    assert column(chunks, "selector/weights", "scalars") == [pytest.approx([0.6, 0.3, 0.06, 0.04])] * 6
    assert column(chunks, "selector/phase", "scalars") == [[0.0]] * 3 + [[1.0]] * 3
    # 1 / (0.36 + 0.09 + 0.0036 + 0.0016)
    assert column(chunks, "selector/effective_candidates", "scalars")[0] == pytest.approx([2.1968], abs=1e-4)
    assert column(chunks, "episode/success", "scalars") == [[0.0]] * 4 + [[1.0]] * 2


def test_arrows_start_at_the_tool_and_the_target_switches_at_contact(chunks):
    proposals = column(chunks, "world/proposals", "vectors")
    assert np.array(proposals[0]) == pytest.approx(
        UNIT_M * np.array([[1, 0, 0], [0.5, 0.5, 0], [0, -1, 0], [-1, 0, 0]])
    )
    assert column(chunks, "world/proposals", "origins")[2][3] == pytest.approx([0.2, 0, 0.1])
    target = column(chunks, "world/target", "vectors")
    assert target[2][0] == pytest.approx([0.1, 0, -0.1])
    assert target[3][0] == pytest.approx([0.2, 0.1, 0])


def test_a_step_without_a_selector_is_refused(tmp_path):
    file, episode = RerunFile(tmp_path / "a.rrd", "t"), rollout(selects=False)
    with pytest.raises(ValueError, match="without a selector"):
        file.add(episode.moments[0], episode)
    file.close()
