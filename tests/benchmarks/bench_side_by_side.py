"""Builds beside each other against builds alone: what a second one costs, and what it waits for.

    python tests/benchmarks/bench_side_by_side.py --edge 256 --rounds 3

Each round builds one scan alone, then one in each of as many processes as there are cores, as the workers of a batch
do. Time in which a process was ready but other processes had the core is taken off (Linux's schedstat), so that the
ratio also holds on a machine that does other things. What is then left is processor time and waiting: disk, driver.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import nibabel
import numpy as np
from rich.console import Console

from volprep_formats.isolation import available_cores

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))
from bench_scans import voxels

_BUILD = """
import json, os, sys, time
from pathlib import Path
from volprep.pipeline.build import build
from volprep.scene.request import request_of
from volprep_formats.progress import Silent

disk, synced = 0.0, os.fsync

def fsync(file):
    global disk
    began = time.monotonic()
    synced(file)
    disk += time.monotonic() - began

os.fsync = fsync

def times():
    # Of the main thread: nanoseconds on a core, and ready without one.
    on_core, ready, _ = map(int, Path("/proc/self/schedstat").read_text().split())
    return time.monotonic(), time.process_time(), on_core / 1e9, ready / 1e9, disk

small, scan, folder = map(Path, sys.argv[1:])
build(request_of(small), folder / "small.volpkg", Silent())  # loads the libraries
began = times()
build(request_of(scan), folder / "scan.volpkg", Silent())
print(json.dumps([end - begin for begin, end in zip(began, times(), strict=True)]))
"""


def started(small: Path, scan: Path, folder: Path) -> subprocess.Popen[str]:
    """Begin a build in a process of its own, with one thread, as a worker of a batch has."""
    folder.mkdir()
    return subprocess.Popen(
        [sys.executable, "-c", _BUILD, small, scan, folder],
        env={**os.environ, "OMP_NUM_THREADS": "1"},
        stdout=subprocess.PIPE,
        text=True,
    )


def measured(process: subprocess.Popen[str]) -> np.ndarray:
    """Seconds: without the time of other processes, of the processor, of waiting, and of the last for the disk."""
    told, _ = process.communicate()
    wall, processor, on_core, ready, disk = json.loads(told)
    return np.array([wall - ready, processor, wall - ready - on_core, disk])


def main() -> None:
    """Measure, and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--edge", type=int, default=256)
    parser.add_argument("--rounds", type=int, default=3)
    wished = parser.parse_args()
    cores, console = available_cores(), Console(highlight=False, soft_wrap=True)
    alone, beside = [], []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        whole = voxels()
        small, scan = folder / "small.nii", folder / "scan.nii"
        nibabel.save(nibabel.Nifti1Image(np.ascontiguousarray(whole[60:90, 60:90, 60:90]), np.eye(4)), small)
        nearest = [np.linspace(0, size - 1, wished.edge).astype(int) for size in whole.shape]
        nibabel.save(nibabel.Nifti1Image(whole[np.ix_(*nearest)], np.eye(4)), scan)
        for number in range(wished.rounds):
            alone.append(measured(started(small, scan, folder / f"{number}")))
            together = [started(small, scan, folder / f"{number}-{core}") for core in range(cores)]
            beside.append(np.mean([measured(each) for each in together], axis=0))
    for said, rounds in (("alone", alone), (f"{cores} beside each other", beside)):
        seconds, processor, waiting, disk = np.median(rounds, axis=0)
        spent = f"{processor:.2f} s of the processor, {waiting:.2f} s of waiting, {disk:.2f} s of that for the disk"
        console.print(f"{said}: {seconds:.2f} s, {spent}")
    ratios = [one[0] / many[0] for one, many in zip(alone, beside, strict=True)]
    console.print(
        f"throughput: {np.median(ratios):.2f} of cores x alone (rounds {min(ratios):.2f} to {max(ratios):.2f})"
    )


if __name__ == "__main__":
    main()
