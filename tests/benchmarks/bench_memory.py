"""Memory and time: a head of 384 DICOM files becomes a package, and so does a raw file of 20 GB.

The command runs as a person would start it, in a process of its own, whose peak is what the system counted as resident.
Beside the time of a large build stands that of what no build can do without: reading the scan, its digest, and writing
as many bytes and bringing them to the disk. The large scan is a block of noisy shells, written again and again.
"""

import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

_SLICE_YX = (1000, 1000)
_DEPTHS = (1000, 10_000)
_VOXEL_BYTES = 2
_BLOCK_SLICES = 100
_SPARE_BYTES = 2 * 10**9
_TIMES_THE_SCAN = 2.5
"""What a build takes on the disk, beside the scan: the imported voxels, their codes, and levels."""
_SCENE = """
name = "large"
[source]
path = "large.raw"
raw = {{ shape_zyx = [{}, {}, {}], dtype = "uint16" }}
[[transfer]]
name = "shells"
points = [
    {{ value = 6000, colour = "#402010", extinction_per_mm = 0 }},
    {{ value = 12000, colour = "#c09060", extinction_per_mm = 0.02 }},
    {{ value = 20000, colour = "#ffffff", extinction_per_mm = 0.5 }},
]
"""
_COMMAND = (sys.executable, "-c", "from volprep_cli.main import main; main()")
_LAUNCHER = """
import os, subprocess, sys
process = subprocess.Popen(sys.argv[1:], stdout=subprocess.DEVNULL)
_, status, used = os.wait4(process.pid, 0)
print(os.waitstatus_to_exitcode(status), used.ru_maxrss)
"""
"""A small process between: Linux counts what the starting process held as the started one's peak."""
_HEAD_SCENE = Path(__file__).parents[2] / "sample_specs" / "mr-head.toml"


@dataclass(frozen=True)
class MemoryRow:
    """One command."""

    work: str
    """What it does."""
    seconds: float
    """Time of the command."""
    peak_mb: float
    """Largest resident memory of its process."""
    bare_seconds: float | None = None
    """Time of reading the source, its digest, and writing as many bytes; nothing where that was not measured."""


def measure_memory(console: Console) -> Iterator[MemoryRow]:
    """Build a head, and packages of scans of 2 GB and of 20 GB.

    The last has 9000 slices more, of which the samples for the plan keep 20 kB each; all else must be the same. What
    the disk has no room for is left out; so is the head where VOLPREP_TEST_DATA does not say where scans are.
    """
    scans = os.environ.get("VOLPREP_TEST_DATA", "")
    with tempfile.TemporaryDirectory() as name:
        if scans:
            series = Path(scans) / "mr_t1_studyforrest" / "dicoms"
            console.print("measuring memory of a build", style="dim")
            target = Path(name) / "head.volpkg"
            yield _measure("build of 384 DICOM files", "build", _HEAD_SCENE, "--source", series, "-o", target)
        for depth in _DEPTHS:
            size = depth * _SLICE_YX[0] * _SLICE_YX[1] * _VOXEL_BYTES
            if shutil.disk_usage(name).free < size * (1 + _TIMES_THE_SCAN) + _SPARE_BYTES:
                console.print(f"a build of {size / 1e9:g} GB is not measured: {name} has no room", style="dim")
                continue
            console.print(f"measuring a build of {size / 1e9:g} GB", style="dim")
            yield measure_build(Path(name), depth)


def memory_table(rows: list[MemoryRow]) -> Table:
    """Table for people."""
    table = Table("work", "s", "largest memory MB", "read, digest, write s", "ratio")
    for column in table.columns[1:]:
        column.justify = "right"
    for row in rows:
        bare = ("", "")
        if row.bare_seconds is not None:
            bare = (f"{row.bare_seconds:.0f}", f"{row.seconds / row.bare_seconds:.1f}")
        table.add_row(row.work, f"{row.seconds:.0f}", f"{row.peak_mb:.0f}", *bare)
    return table


def measure_build(folder: Path, depth: int) -> MemoryRow:
    """Build a package of a raw file of so many slices."""
    raw, scene, target = folder / "large.raw", folder / "large.toml", folder / "large.volpkg"
    _write_scan(raw, depth)
    scene.write_text(_SCENE.format(depth, *_SLICE_YX), encoding="utf-8")
    bare_seconds = _bare_seconds(raw, folder / "copy.raw")
    row = _measure(f"build of {raw.stat().st_size / 1e9:g} GB of raw voxels", "build", scene, "-o", target)
    shutil.rmtree(target)
    raw.unlink()
    return replace(row, bare_seconds=bare_seconds)


def _write_scan(path: Path, depth: int) -> None:
    z, y, x = np.ogrid[:_BLOCK_SLICES, : _SLICE_YX[0], : _SLICE_YX[1]]
    distance = np.sqrt((10 * (z - _BLOCK_SLICES / 2)) ** 2 + (y - _SLICE_YX[0] / 2) ** 2 + (x - _SLICE_YX[1] / 2) ** 2)
    block = 8000 + 8000 * np.cos(distance / 25) * (distance < _SLICE_YX[0] / 2)
    noise = np.random.default_rng(1).normal(0, 300, block.shape)
    voxels = np.clip(np.rint(block + noise), 0, 65535).astype("<u2")
    with path.open("wb") as file:
        for begin in range(0, depth, _BLOCK_SLICES):
            file.write(voxels[: depth - begin].data)


def _bare_seconds(source: Path, target: Path) -> float:
    start = time.perf_counter()
    digest = hashlib.sha256()
    with source.open("rb") as read, target.open("wb") as written:
        while block := read.read(1 << 24):
            digest.update(block)
            written.write(block)
        os.fsync(written.fileno())
    seconds = time.perf_counter() - start
    target.unlink()
    return seconds


def _measure(work: str, *arguments: str | Path) -> MemoryRow:
    start = time.perf_counter()
    launched = subprocess.run(
        [sys.executable, "-c", _LAUNCHER, *_COMMAND, *arguments], stdout=subprocess.PIPE, text=True, check=False
    )
    seconds = time.perf_counter() - start
    status, peak_kib = (int(word) for word in launched.stdout.split())
    if status:
        raise subprocess.CalledProcessError(status, [*_COMMAND, *arguments])
    return MemoryRow(work, seconds, peak_kib * 1024 / 1e6)
