"""A batch of many small scans against the same builds one after the other: scans a second, and what a rerun costs.

    python tests/benchmarks/bench_batch.py --scans 60

Scans are boxes cut from a real head (VOLPREP_TEST_DATA) or from a phantom; one in a hundred, at least one, is cut off
in the middle. Both sides use one thread for each process.
"""

import argparse
import os
import sys
import tempfile
import time
from pathlib import Path

import nibabel
import numpy as np
from rich.console import Console

from volprep.batch.cluster import Local
from volprep.batch.guard import Limits
from volprep.batch.jobs import Defaults, Job
from volprep.batch.place import Place
from volprep.batch.run import Wishes, find_jobs, run_batch
from volprep.batch.work import TaskResult
from volprep.pipeline.build import build
from volprep_formats.diagnostics import VolprepError
from volprep_formats.isolation import available_cores
from volprep_formats.progress import Silent

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))
from bench_scans import voxels

_EDGE = 48
_SERIAL = 20
"""Builds one after the other that are measured, after one that loads the libraries."""


class Clock:
    """Notes when jobs end."""

    def __init__(self) -> None:
        self.ends: list[float] = []
        self.failed = 0
        self.peak_bytes = 0
        self.unchanged = 0
        self.seconds: list[float] = []

    def begin(self, jobs: int) -> None:
        """Jobs begin."""

    def ended(self, ended: TaskResult) -> None:
        """Note an end."""
        self.ends.append(time.monotonic())
        assert ended.record is not None
        self.failed += ended.record.outcome == "failed"
        self.unchanged += not ended.is_new
        self.seconds.append(ended.record.seconds)
        self.peak_bytes = max(self.peak_bytes, ended.record.peak_memory_bytes)


def write_scans(folder: Path, count: int) -> None:
    """Write boxes at different places, and cut off one in a hundred."""
    whole, places = voxels(), np.random.default_rng(15)
    for number in range(count):
        start = [int(places.integers(0, size - _EDGE)) for size in whole.shape]
        box = whole[tuple(slice(s, s + _EDGE) for s in start)]
        path = folder / f"{number // 100:04d}" / f"{number:06d}.nii"
        path.parent.mkdir(exist_ok=True)
        nibabel.save(nibabel.Nifti1Image(np.ascontiguousarray(box), np.eye(4)), path)
        if number % 100 == 50 or number == count - 1 < 50:
            os.truncate(path, 5000)


def serial_rate(jobs: list[Job], folder: Path) -> tuple[float, float]:
    """Scans a second, one after the other in this process, and processor seconds a scan."""
    began, spent, done = 0.0, 0.0, -1
    for job in jobs[: _SERIAL + 1]:
        if done == 0:
            began, spent = time.monotonic(), time.process_time()
        try:
            build(job.request, folder / f"{job.name}.volpkg", Silent())
        except VolprepError:
            continue
        done += 1
    return done / (time.monotonic() - began), (time.process_time() - spent) / done


def processor_seconds() -> np.ndarray:
    """Of this process, and of those that it started and that have ended."""
    times = os.times()
    return np.array([times.user + times.system, times.children_user + times.children_system])


def main() -> None:
    """Measure, and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scans", type=int, default=60)
    parser.add_argument("--workers", type=int, default=available_cores())
    wished = parser.parse_args()
    console = Console(highlight=False)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "in").mkdir()
        write_scans(folder / "in", wished.scans)
        place = Place(folder / "out")
        jobs = find_jobs(folder / "in", place, Defaults(), Silent())
        serial, serial_cpu = serial_rate(jobs, folder / "serial")
        wishes = Wishes(validate=False, retry_failed=False, limits=Limits(600.0, None))
        clock, began, spent = Clock(), time.monotonic(), processor_seconds()
        run_batch(jobs, place, wishes, Local(wished.workers, lambda _link: None), clock)
        seconds, spent = time.monotonic() - began, processor_seconds() - spent
        # The first of each worker loads the libraries, and is not counted.
        ends = clock.ends[wished.workers :]
        steady = (len(ends) - 1) / (ends[-1] - ends[0])
        again, began = Clock(), time.monotonic()
        run_batch(jobs, place, wishes, Local(wished.workers, lambda _link: None), again)
        rerun = time.monotonic() - began
    # What is missing to 1 is the engine's: handing out, locks, the ledger. What slows the builds is the machine's.
    busy = sum(clock.seconds[wished.workers + 1 :]) / (wished.workers * (ends[-1] - ends[0]))
    bar = wished.workers * serial
    console.print(f"{len(jobs)} scans, {clock.failed} damaged; one after the other: {serial:.2f} scans/s")
    console.print(f"{wished.workers} workers: {steady:.2f} scans/s, {steady / bar:.2f} of workers x serial")
    console.print(
        "processor seconds a scan: {:.3f} one after the other; in the batch {:.3f} here and {:.3f} in workers, "
        "with their start".format(serial_cpu, *(spent / len(jobs)))
    )
    console.print(f"workers build for {busy:.2f} of their time")
    console.print(f"with the start of the workers: {len(jobs) / seconds:.2f} scans/s, {seconds:.1f} s")
    console.print(
        f"rerun, unchanged: {again.unchanged} in {rerun:.2f} s; memory of a worker {clock.peak_bytes / 1e6:.0f} MB"
    )


if __name__ == "__main__":
    main()
