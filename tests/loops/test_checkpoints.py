"""A checkpoint comes back bit for bit, or an error says what is wrong; a kill never costs the last one."""

import json
import random
import signal
import subprocess
import sys
import time

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optax
import pytest

from hcpg.loops.checkpoints import CheckpointError, damage, latest, load, load_raw, save, step_of


def tree_of(seed):
    """An MLP with Adam's state, counters, flags, a NumPy buffer, both kinds of random keys."""
    network = eqx.nn.MLP(3, 2, 8, 1, key=jax.random.key(seed))
    optimizer = optax.adam(1e-3)
    moments = optimizer.init(eqx.filter(network, eqx.is_array))
    grads = jax.tree.map(jnp.ones_like, eqx.filter(network, eqx.is_array))
    _, moments = optimizer.update(grads, moments)
    return {
        "network": network,
        "moments": moments,
        "updates": jnp.array(seed, jnp.int32),
        "done": jnp.array([True, False]),
        "typed": jax.random.key(seed),
        "raw": jax.random.PRNGKey(seed),
        "buffer": np.arange(6.0).reshape(2, 3)[:, ::2] + seed,
        "nothing": None,
    }


def leaf_bytes(tree):
    keys = [leaf for leaf in jax.tree.leaves(tree) if eqx.is_array(leaf)]
    plain = [jax.random.key_data(k) if jnp.issubdtype(k.dtype, jax.dtypes.prng_key) else k for k in keys]
    return [(str(leaf.dtype), leaf.shape, np.asarray(leaf).tobytes()) for leaf in plain]


@pytest.fixture
def saved(tmp_path):
    trees = {"state": tree_of(1), "replay": {"rewards": np.arange(5, dtype=np.float32)}}
    return save(tmp_path, 12_000, trees, {"episodes": 7, "generator": 2**127 + 1, "rate": 0.1})


def test_round_trip_bit_for_bit(saved):
    assert saved.name == "step_000012000"
    assert sorted(file.name for file in saved.iterdir()) == [
        "facts.json",
        "replay.safetensors",
        "state.safetensors",
    ]
    trees, facts = load(saved, {"state": tree_of(2)})
    assert list(trees) == ["state"]
    assert leaf_bytes(trees["state"]) == leaf_bytes(tree_of(1))
    assert jax.tree.structure(trees["state"]) == jax.tree.structure(tree_of(1))
    assert facts == {"episodes": 7, "generator": 2**127 + 1, "rate": 0.1}
    restored, original = trees["state"], tree_of(1)
    assert float(jax.random.normal(restored["typed"])) == float(jax.random.normal(original["typed"]))
    point = jnp.array([0.1, 0.2, 0.3])
    np.testing.assert_array_equal(restored["network"](point), original["network"](point))
    assert isinstance(restored["buffer"], np.ndarray)
    restored["buffer"][0, 0] = 9.0


def test_a_tree_can_be_read_without_a_template(saved):
    raw = load_raw(saved, "replay")
    assert list(raw) == ["['rewards']"]
    np.testing.assert_array_equal(raw["['rewards']"], [0.0, 1.0, 2.0, 3.0, 4.0])


def test_facts_list_every_file_with_its_hash(saved):
    files = json.loads((saved / "facts.json").read_text())["files"]
    listed = {f"{name}.safetensors": entry["sha256"] for name, entry in files.items()}
    output = subprocess.run(
        ["sha256sum", *listed], cwd=saved, capture_output=True, text=True, check=True
    ).stdout
    assert {line.split()[1]: line.split()[0] for line in output.splitlines()} == listed
    assert files["replay"]["arrays"] == {"['rewards']": "float32[5]"}


@pytest.mark.parametrize("name", ["state.safetensors", "replay.safetensors", "facts.json"])
@pytest.mark.parametrize("place", [0.0, 0.2, 0.5, 0.999])
def test_one_flipped_bit_anywhere_is_found(saved, name, place):
    file = saved / name
    content = bytearray(file.read_bytes())
    content[int(place * len(content))] ^= 4
    file.write_bytes(content)
    reason = damage(saved)
    assert reason is not None
    assert f"{name} " in reason
    with pytest.raises(CheckpointError, match="Take another checkpoint from"):
        load(saved, {"state": tree_of(2), "replay": {"rewards": np.zeros(5, np.float32)}})


def test_truncated_and_missing_files_are_named(saved):
    file = saved / "state.safetensors"
    size = file.stat().st_size
    file.write_bytes(file.read_bytes()[:-1])
    with pytest.raises(CheckpointError, match=f"state.safetensors has {size - 1} bytes instead of {size}"):
        load(saved, {"state": tree_of(2)})
    file.unlink()
    with pytest.raises(CheckpointError, match=r"state\.safetensors is missing"):
        load(saved, {"state": tree_of(2)})
    assert load_raw(saved, "replay")["['rewards']"].shape == (5,)
    (saved / "facts.json").write_text('{"format": 1')
    with pytest.raises(CheckpointError, match=r"facts\.json is missing or altered"):
        load_raw(saved, "replay")


def test_a_tree_that_does_not_fit_is_refused_leaf_by_leaf(tmp_path):
    tree = {"a": jnp.zeros(3), "b": jnp.zeros(2, jnp.int32), "c": np.zeros(1), "rate": 0.5}
    path = save(tmp_path, 1, {"state": tree}, {})
    other = {"a": jnp.zeros(4), "b": jnp.zeros(2, jnp.uint32), "d": np.zeros(1), "rate": 0.25}
    with pytest.raises(CheckpointError) as caught:
        load(path, {"state": other})
    assert str(caught.value).splitlines()[1:] == [
        "  state['a']: float32[3] in the checkpoint, float32[4] expected",
        "  state['b']: int32[2] in the checkpoint, uint32[2] expected",
        "  state['c']: float64[1] in the checkpoint, absent expected",
        "  state['d']: absent in the checkpoint, float64[1] expected",
        "  state['rate']: 0.5 in the checkpoint, 0.25 expected",
        "Load it under the configuration it was made with (the run's config.json).",
    ]
    with pytest.raises(CheckpointError, match="it holds no tree 'replay', only state"):
        load_raw(path, "replay")


def test_empty_scalar_and_strided_arrays(tmp_path):
    wide = np.arange(24.0).reshape(2, 3, 4)
    tree = {
        "none": np.zeros((0, 3), np.float32),
        "scalar": np.float32(2.5),
        "part": wide[:, :2],
        "turned": wide.T,
    }
    path = save(tmp_path, 0, {"state": tree}, {})
    raw = load_raw(path, "state")
    assert raw["['none']"].shape == (0, 3)
    np.testing.assert_array_equal(raw["['part']"], wide[:, :2])
    np.testing.assert_array_equal(raw["['turned']"], wide.T)
    restored = load(path, {"state": tree})[0]["state"]
    assert type(restored["scalar"]) is np.float32
    assert restored["scalar"] == 2.5


def steps_in(folder):
    return sorted(path.name for path in folder.iterdir())


def test_the_newest_two_stay(tmp_path):
    assert latest(tmp_path) is None
    for step in (10, 20, 30):
        save(tmp_path, step, {"state": {"step": np.array(step)}}, {})
    assert steps_in(tmp_path) == ["step_000000020", "step_000000030"]
    assert latest(tmp_path) == tmp_path / "step_000000030"
    assert latest(tmp_path, not_after=29) == tmp_path / "step_000000020"
    assert latest(tmp_path, not_after=19) is None


def test_a_step_saved_again_is_replaced(tmp_path):
    for value in (1, 2):
        save(tmp_path, 10, {"state": {"value": np.array(value)}}, {"value": value})
    assert steps_in(tmp_path) == ["step_000000010"]
    assert load(tmp_path / "step_000000010", {})[1] == {"value": 2}


def test_a_kill_between_setting_aside_and_replacing_loses_nothing(tmp_path):
    path = save(tmp_path, 10, {}, {"value": 1})
    aside = path.rename(tmp_path / "step_000000010.replaced")
    assert latest(tmp_path) == aside
    assert step_of(aside) == 10
    save(tmp_path, 10, {}, {"value": 2})
    assert steps_in(tmp_path) == ["step_000000010"]


def test_training_taken_up_earlier_drops_what_lies_ahead(tmp_path):
    for step in (10, 20):
        save(tmp_path, step, {}, {})
    save(tmp_path, 15, {}, {})
    assert steps_in(tmp_path) == ["step_000000010", "step_000000015"]


def test_latest_passes_over_damage_and_says_so(tmp_path, caplog):
    for step in (10, 20):
        save(tmp_path, step, {"state": {"x": np.zeros(3)}}, {})
    (tmp_path / "step_000000020" / "state.safetensors").unlink()
    assert latest(tmp_path) == tmp_path / "step_000000010"
    assert "step_000000020: state.safetensors is missing" in caplog.text
    (tmp_path / "step_000000010" / "facts.json").unlink()
    with pytest.raises(CheckpointError, match=r"every checkpoint in .* is damaged"):
        latest(tmp_path)


def test_leftovers_of_a_kill_are_swept_at_the_next_save(tmp_path):
    (tmp_path / ".writing-step_000000010").mkdir()
    (tmp_path / ".writing-step_000000010" / "state.safetensors").write_bytes(b"half")
    assert latest(tmp_path) is None
    save(tmp_path, 10, {}, {})
    assert steps_in(tmp_path) == ["step_000000010"]


def test_facts_that_json_cannot_hold_leave_the_last_checkpoint(tmp_path):
    save(tmp_path, 10, {}, {"value": 1})
    with pytest.raises(ValueError, match="not JSON compliant"):
        save(tmp_path, 20, {}, {"value": float("nan")})
    assert latest(tmp_path) == tmp_path / "step_000000010"


SAVER = """
import sys
from pathlib import Path
import numpy as np
from hcpg.loops.checkpoints import save
folder = Path(sys.argv[1])
for step in range(int(sys.argv[2]), 10**9):
    trees = {"state": {"x": np.full(50_000, step)}, "replay": {"y": np.full(200_000, step)}}
    save(folder, step, trees, {"n": step})
    print(step, flush=True)
"""


def test_kill_at_random_moments_always_leaves_a_loadable_checkpoint(tmp_path):
    moments = random.Random(0)
    reached = 0
    for _ in range(6):
        saver = subprocess.Popen(
            [sys.executable, "-c", SAVER, str(tmp_path), str(reached)], stdout=subprocess.PIPE, text=True
        )
        assert saver.stdout is not None
        confirmed = int(saver.stdout.readline())
        time.sleep(moments.uniform(0.0, 0.15))
        saver.send_signal(signal.SIGKILL)
        rest = saver.communicate()[0].split("\n")
        confirmed = max([confirmed, *(int(line) for line in rest[:-1])])
        path = latest(tmp_path)
        assert path is not None
        trees, facts = load(path, {"state": {"x": np.zeros(50_000, int)}})
        reached = facts["n"]
        assert reached in (confirmed, confirmed + 1)
        assert (trees["state"]["x"] == reached).all()
        assert (load_raw(path, "replay")["['y']"] == reached).all()
    assert reached > 6
