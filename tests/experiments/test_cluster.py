"""A real Ray cluster of two nodes on this machine, one of which is killed while it trains."""

import signal
import tempfile
import time
from pathlib import Path

import pytest
from tiny_cells import cell

from hcpg.experiments import cluster, engine
from hcpg.experiments.claims import is_locked
from hcpg.experiments.cluster import ClusterError, RayCluster, _jobs_on
from hcpg.experiments.engine import LOST, run
from hcpg.experiments.ledger import entries, newest_checkpoint
from hcpg.experiments.station import Needs
from hcpg.experiments.units import units
from hcpg.loops import sitting
from hcpg.loops.runs import RunFolder

# Ray starts its servers by a fork that becomes another program at once, of which JAX warns.
pytestmark = pytest.mark.filterwarnings(r"ignore:os.fork\(\) was called:RuntimeWarning")
LENGTH = {"steps": 1000, "evaluations": 5}


@pytest.fixture(scope="module")
def nodes():
    """A head and a second node with a core each, and the folder that is theirs."""
    from ray.cluster_utils import Cluster

    terminate = signal.getsignal(signal.SIGTERM)
    # Short, since the names of Ray's sockets have to fit into 107 bytes.
    with tempfile.TemporaryDirectory(prefix="ray-") as own, pytest.MonkeyPatch.context() as patch:
        for name in ("RAY_TMPDIR", "TMPDIR"):
            patch.setenv(name, own)
        patch.setenv("RAY_USAGE_STATS_ENABLED", "0")
        patch.setenv("PYTHONWARNINGS", "ignore")
        (Path(own) / "ray").mkdir()
        size = {"num_cpus": 1, "object_store_memory": 80 * 2**20}
        made = Cluster()
        try:
            made.add_node(**size, include_dashboard=False)
            yield made, made.add_node(**size), Path(own)
        finally:
            made.shutdown()
            signal.signal(signal.SIGTERM, terminate)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """The same runs, each in one piece and in this process."""
    folders = {}
    for seed in (0, 1):
        settings = cell(seed, **LENGTH).settings
        [folders[seed]] = sitting.create_folders(settings, [seed], tmp_path_factory.mktemp("undisturbed"))
        sitting.sit(settings, [folders[seed]], 1, lambda event: None, lambda: False)
    return folders


def learned(folder):
    """The bytes of the networks and the replay at the end, and every row but its clock."""
    last = folder.checkpoints / f"step_{newest_checkpoint(folder.path):09d}"
    files = {file.name: file.read_bytes() for file in last.glob("*.safetensors")}
    # `train_success` is of the newest episodes of one sitting.
    of_the_sitting = {"wall_s", "steps_per_s", "train_success"}
    rows = [{name: each[name] for name in each.keys() - of_the_sitting} for each in folder.rows("metrics")]
    return last.name, files, folder.rows("episodes"), rows


def test_an_experiment_loses_a_node_and_ends_with_the_undisturbed_results(
    nodes, undisturbed, tmp_path, monkeypatch
):
    from ray._private.state import actors

    made, second, own = nodes
    cells = [cell(seed, **LENGTH) for seed in (0, 1)]
    told, words, lost = [], [], []
    land, command = cluster.land, cluster.command

    def land_and_kill(parcel, results):
        """The second node dies as soon as a checkpoint of its job has arrived."""
        land(parcel, results)
        for folder in parcel.checkpoints if not lost else ():
            job = place._jobs[int(Path(folder).parent.name.removeprefix("s"))]
            node = actors(job._station._actor_id.hex())["Address"]["NodeID"]
            step = newest_checkpoint(results / folder)
            if node == second.node_id and step is not None:
                lost.append(step)
                made.remove_node(second, allow_graceful=False)

    monkeypatch.setattr(cluster, "land", land_and_kill)
    monkeypatch.setattr(cluster, "command", lambda *given: words.append(command(*given)) or words[-1])
    monkeypatch.setattr(engine, "POLL_S", 0.05)
    place = RayCluster(made.address, Needs(1, 0.0), send_s=0.2)
    assert place.room()
    ended = run(cells, tmp_path, place, told.append)
    place.close()
    assert ended == ([], None), (told, [log.read_text() for log in (tmp_path / "logs").iterdir()])

    assert 0 < lost[0] < LENGTH["steps"]
    assert sum("lost with node" in text for text in told) == 1
    assert [each[1] for each in words] == ["--task", "--task", "--resume"]
    for entry in entries(cells, tmp_path):
        assert entry.state == "finished"
        assert learned(RunFolder(entry.folder)) == learned(undisturbed[entry.cell.seed])
    assert len(list(tmp_path.glob("point/reach/sac/s?/*"))) == 2
    assert len(list((tmp_path / "logs").iterdir())) == 2
    # What the lost node had begun has ended, too: it does not go on unseen.
    deadline = time.monotonic() + 20
    while any(is_locked(lock) for lock in own.rglob("jobs/*/lock")):
        assert time.monotonic() < deadline
        time.sleep(0.1)


def test_a_job_that_waits_for_a_node_and_one_that_is_killed_both_end(nodes, tmp_path):
    made, _, _ = nodes
    place = RayCluster(made.address, Needs(1, 0.0))
    found = units(entries([cell(seed, steps=100_000) for seed in (0, 1)], tmp_path), together=False)
    begun, waiting = (place.start(unit, tmp_path, []) for unit in found)
    assert not place.room()  # the head alone is left
    while begun.place == "the cluster":
        assert begun.poll() is None
        time.sleep(0.05)
    assert waiting.place == "the cluster"
    for job, at_once in ((waiting, False), (begun, True)):
        job.stop(at_once=at_once)
        while (code := job.poll()) is None:
            time.sleep(0.05)
        assert code == LOST
        assert "killed" in (tmp_path / job._log).read_text()
    assert place.room()
    place.close()


def test_a_job_that_no_node_can_hold_is_refused(nodes):
    with pytest.raises(ClusterError, match=r"no node has room for a job of 1 cores and 0\.5 GPUs"):
        RayCluster(nodes[0].address, Needs(1, 0.5), patience_s=0.0)


def test_a_cluster_that_does_not_answer_is_named():
    with pytest.raises(ClusterError, match=r"no Ray cluster answers at '127\.0\.0\.1:1'"):
        RayCluster("127.0.0.1:1", Needs(1, 0.0), patience_s=0.0)


@pytest.mark.parametrize(
    ("node", "needs", "jobs"),
    [
        ({"CPU": 16.0, "GPU": 2.0}, Needs(1, 0.0), 16),
        ({"CPU": 16.0, "GPU": 2.0}, Needs(3, 0.0), 5),
        ({"CPU": 16.0, "GPU": 2.0}, Needs(2, 0.5), 4),
        ({"CPU": 16.0, "GPU": 2.0}, Needs(2, 0.3), 6),
        ({"CPU": 16.0, "GPU": 2.0}, Needs(8, 0.25), 2),
        ({"CPU": 16.0}, Needs(1, 1.0), 0),
        ({"memory": 1e9}, Needs(1, 0.0), 0),
    ],
)
def test_how_many_jobs_a_node_holds(node, needs, jobs):
    assert _jobs_on(node, needs) == jobs
