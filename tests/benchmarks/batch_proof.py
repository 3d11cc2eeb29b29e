"""A batch that is disturbed as badly as possible, against the same builds one after the other, undisturbed.

    python -m tests.benchmarks.batch_proof --scans 300

Scans are boxes cut from a real head (VOLPREP_TEST_DATA) or from a phantom. One in a hundred, at least one, is damaged,
in ten ways in turn. Workers are killed at random, and the whole batch is killed twice and run again. Then each scan
must have one final record, each package the bytes of the undisturbed build, each damaged scan the code that it has
alone, and a rerun must do nothing. Ends with status 1 if one of these does not hold.
"""

import argparse
import contextlib
import hashlib
import json
import os
import random
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import nibabel
import numpy as np
import psutil

from volprep.batch.jobs import Defaults, Job
from volprep.batch.place import Place
from volprep.batch.run import find_jobs
from volprep.pipeline.build import build
from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))
from batch_scans import builders, records
from bench_scans import voxels
from command_line import COMMAND

_EDGE = 24
_LOOK_S = 0.1
"""Between two looks at the ledger: what is watched must not be slowed by it."""
_DIM, _DATATYPE, _OFFSET, _SFORM = 40, 70, 108, 280


def _put(at: int, form: str, *values: float) -> Callable[[bytes], bytes]:
    packed = struct.pack(f"<{form}", *values)
    return lambda content: content[:at] + packed + content[at + len(packed) :]


DAMAGES: tuple[Callable[[bytes], bytes], ...] = (
    lambda content: content[:350],
    lambda content: content[: len(content) // 2],
    lambda content: content[:-1],
    _put(_DIM, "h", 0),
    _put(_DIM + 2, "h", 0),
    _put(_DIM + 4, "h", -5),
    _put(_DATATYPE, "h", 1234),
    _put(_OFFSET, "f", 1e9),
    _put(_SFORM, "f", float("nan")),
    _put(_SFORM, "12f", *[0.0] * 12),
)


def write_scans(folder: Path, count: int, chance: random.Random) -> int:
    """Write boxes at different places and of different sizes, and return how many are damaged."""
    whole = voxels()
    damaged = set(chance.sample(range(count), max(1, count // 100)))
    for number in range(count):
        edge = _EDGE + number % 7
        first = [chance.randrange(size - edge) for size in whole.shape]
        box = np.ascontiguousarray(whole[tuple(slice(f, f + edge) for f in first)])
        path = folder / f"{number // 100:04d}" / f"{number:06d}.nii"
        path.parent.mkdir(parents=True, exist_ok=True)
        nibabel.save(nibabel.Nifti1Image(box, np.eye(4)), path)
        if number in damaged:
            path.write_bytes(DAMAGES[sorted(damaged).index(number) % len(DAMAGES)](path.read_bytes()))
    return len(damaged)


def digest_of(package: Path) -> str:
    """Digest of the names and bytes of all files of a package."""
    digest = hashlib.sha256()
    for path in sorted(each for each in package.rglob("*") if each.is_file()):
        digest.update(f"{path.relative_to(package)}\0{path.stat().st_size}\0".encode() + path.read_bytes())
    return digest.hexdigest()


def undisturbed(jobs: list[Job], folder: Path) -> tuple[dict[str, str], float]:
    """Build each job in this process. Return its package's digest, or its error's code, by name, and scans a second."""
    found: dict[str, str] = {}
    # The first build loads the libraries.
    with contextlib.suppress(VolprepError):
        build(jobs[0].request, folder / "warm.volpkg", Silent())
    began = time.monotonic()
    spent = 0.0
    for job in jobs:
        package = folder / f"{job.name}.volpkg"
        try:
            build(job.request, package, Silent())
        except VolprepError as error:
            found[job.name] = error.code
            continue
        paused = time.monotonic()
        found[job.name] = digest_of(package)
        shutil.rmtree(package)
        spent += time.monotonic() - paused
    return found, len(jobs) / (time.monotonic() - began - spent)


class Disturbed:
    """Runs batches over one folder, and kills."""

    def __init__(self, source: Path, out: Path, arguments: list[str], chance: random.Random) -> None:
        self.killed = 0
        self.parent_bytes = 0
        self._command = (source, "-o", out, *arguments)
        self._out = out
        self._chance = chance

    def run(self, until: int | None, kills: int, every_s: float, *more: str) -> subprocess.Popen[bytes]:
        """Run a batch, kill workers now and then, and the whole batch when the ledger has `until` records."""
        process = subprocess.Popen(
            [*COMMAND, "batch", *map(str, self._command), *more],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        left, next_kill = kills, time.monotonic() + every_s
        while process.poll() is None:
            with contextlib.suppress(psutil.Error):
                self.parent_bytes = max(self.parent_bytes, psutil.Process(process.pid).memory_info().rss)
            if until is not None and self._lines() >= until:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
                break
            if left and time.monotonic() > next_kill and self._kill_one(process):
                left -= 1
                next_kill = time.monotonic() + every_s * self._chance.uniform(0.5, 1.5)
            time.sleep(_LOOK_S)
        return process

    def _lines(self) -> int:
        """Whole lines of the ledger."""
        ledger = self._out / "ledger.jsonl"
        return ledger.read_bytes().count(b"\n") if ledger.exists() else 0

    def _kill_one(self, process: subprocess.Popen[bytes]) -> bool:
        with contextlib.suppress(psutil.Error):
            found = builders(process, self._out)
            if found:
                self._chance.choice(found).kill()
                self.killed += 1
                return True
        return False


def wrong(out: Path, expected: dict[str, str]) -> list[str]:
    """Say what is not as it must be: records, bytes of packages, codes."""
    found = records(out)
    said = [] if len(found) == len(expected) else [f"{len(found)} records of {len(expected)} jobs"]
    by_name = {str(record["name"]): record for record in found}
    if by_name.keys() != expected.keys():
        said.append("the names are others")
    for name, right in expected.items():
        record = by_name.get(name)
        if record is None:
            continue
        errors = record["errors"]
        is_built = record["outcome"] == "built"
        came = digest_of(out / str(record["package"])) if is_built else str(errors[0]["code"])  # type: ignore[index]
        if came != right:
            said.append(f"{name}: {came}, and alone {right}")
    return said


def prove(folder: Path, wished: argparse.Namespace) -> dict[str, object]:
    """Do it all, and return what was measured and what is wrong."""
    chance = random.Random(15)  # noqa: S311 - no secret
    (folder / "in").mkdir()
    damaged = write_scans(folder / "in", wished.scans, chance)
    out = folder / "out"
    jobs = find_jobs(folder / "in", Place(out), Defaults(), Silent())
    expected, rate = undisturbed(jobs, folder / "serial")
    arguments = ["--scheduler", wished.scheduler] if wished.scheduler else ["--workers", str(wished.workers)]
    disturbed = Disturbed(folder / "in", out, arguments, chance)
    began = time.monotonic()
    each = wished.kills // 3
    for until in (len(jobs) // 3, 2 * len(jobs) // 3):
        disturbed.run(until, each, wished.every)
    disturbed.run(None, wished.kills - 2 * each, wished.every)
    # A scan whose workers were killed twice by chance is recorded so, and is tried again if that is wished.
    unlucky = sum(record["errors"][0]["code"] == "VP8020" for record in records(out) if record["errors"])
    if unlucky:
        disturbed.run(None, 0, 1.0, "--retry-failed")
    seconds = time.monotonic() - began
    before, began = (out / "ledger.jsonl").read_bytes(), time.monotonic()
    disturbed.run(None, 0, 1.0)
    rerun = time.monotonic() - began
    said = wrong(out, expected)
    if (out / "ledger.jsonl").read_bytes() != before:
        said.append("the rerun built something")
    left = [path.name for path in (out / ".batch").iterdir() if path.name not in {"key", "ledger.lock", "names.jsonl"}]
    return {
        "scans": len(jobs),
        "damaged": damaged,
        "failed": sum(record["outcome"] == "failed" for record in records(out)),
        "workers_killed": disturbed.killed,
        "batches_killed": 2,
        "recorded_as_killed_twice": unlucky,
        "seconds": round(seconds, 1),
        "rerun_seconds": round(rerun, 1),
        "of_workers_times_serial": round(len(jobs) / seconds / rate / wished.workers, 2),
        "worker_mb": round(max(int(str(record["peak_memory_bytes"])) for record in records(out)) / 1e6),
        "batch_mb": round(disturbed.parent_bytes / 1e6),
        "left_behind": left,
        "wrong": said,
    }


def main() -> int:
    """Prove, and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scans", type=int, default=300)
    parser.add_argument("--workers", type=int, default=2, help="processes, also of a scheduler")
    parser.add_argument("--scheduler", help="address of a Dask scheduler")
    parser.add_argument("--kills", type=int, default=20, help="workers that are killed")
    parser.add_argument("--every", type=float, default=2.0, help="mean seconds between two of them")
    os.environ["OMP_NUM_THREADS"] = "1"
    with tempfile.TemporaryDirectory() as name:
        found = prove(Path(name), parser.parse_args())
    print(json.dumps(found, indent=1))
    return 1 if found["wrong"] else 0


if __name__ == "__main__":
    sys.exit(main())
