"""Jobs that train nothing: they write what a training would leave behind, and end as they are told."""

from hcpg.experiments.engine import LOST
from hcpg.experiments.units import Unit
from hcpg.loops.runs import RunFolder

LEAVES = {0: "finished", 3: "diverged", 1: "failed", LOST: "running", 143: "stopped"}


class StandInJob:
    """Ends at the `polls`-th look with the code, or with 143 once it is asked to stop."""

    def __init__(self, unit: Unit, results, code, polls):
        self.place = "nowhere"
        self.unit, self.code, self.polls = unit, code, polls
        self.folders = [RunFolder(path) for path in unit.folders] or [
            create(each, results) for each in unit.cells
        ]
        self.stops = []

    def poll(self):
        self.polls -= 1
        if self.polls > 0:
            return None
        for folder in self.folders:
            folder.set_status(LEAVES[self.code])
        return self.code

    def stop(self, *, at_once):
        self.stops.append(at_once)
        self.code, self.polls = 143, 0


class StandInPlace:
    """Room for `most` jobs; `codes` are those of the first jobs, all later ones finish."""

    def __init__(self, codes=(), most=1, polls=1, together=False):
        self.together = together
        self.codes, self.most, self.polls = list(codes), most, polls
        self.jobs, self.at_once = [], []

    def room(self):
        self.at_once.append(sum(job.polls > 0 for job in self.jobs))
        return self.at_once[-1] < self.most

    def start(self, unit, results, claims):
        code = self.codes.pop(0) if self.codes else 0
        self.jobs.append(StandInJob(unit, results, code, self.polls))
        return self.jobs[-1]

    def close(self):
        self.most = 0


def create(cell, results):
    settings = cell.settings
    address = {"task": settings.task, "preset": settings.preset, "seed": cell.seed}
    return RunFolder.create(results, **address, config=settings.as_json(), manifest={})
