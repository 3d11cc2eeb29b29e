"""Memory: a head of 384 DICOM files becomes a package; a raw file of 20 GB, a hole on the disk, becomes a draft.

The command runs as a person would start it, in a process of its own, whose peak is what the system counted as resident.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

SHAPES_ZYX = ((1000, 1000, 1000), (10_000, 1000, 1000))
_VOXEL_BYTES = 2
_SPARE_BYTES = 2 * 10**9
_SCENE = """
name = "large"
[source]
path = "large.raw"
raw = {{ shape_zyx = [{}, {}, {}], dtype = "uint16" }}
[[transfer]]
name = "ramp"
points = [
    {{ value = 0, colour = "#000000", extinction_per_mm = 0 }},
    {{ value = 9, colour = "#ffffff", extinction_per_mm = 1 }},
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


def measure_memory(console: Console) -> list[MemoryRow]:
    """Build a head, and import a file of 2 GB and one of 20 GB.

    The second has 9000 slices more, of which the samples for the plan keep 20 kB each; all else must be the same.
    What the disk has no room for is left out; so is the head where VOLPREP_TEST_DATA does not say where scans are.
    """
    rows = []
    scans = os.environ.get("VOLPREP_TEST_DATA", "")
    with tempfile.TemporaryDirectory() as name:
        if scans:
            series = Path(scans) / "mr_t1_studyforrest" / "dicoms"
            console.print("measuring memory of a build", style="dim")
            target = Path(name) / "head.volpkg"
            rows.append(_measure("build of 384 DICOM files", "build", _HEAD_SCENE, "--source", series, "-o", target))
        for shape_zyx in SHAPES_ZYX:
            size = shape_zyx[0] * shape_zyx[1] * shape_zyx[2] * _VOXEL_BYTES
            if shutil.disk_usage(name).free < size + _SPARE_BYTES:
                console.print(f"import of {size / 1e9:g} GB is not measured: {name} has no room", style="dim")
                continue
            console.print(f"measuring memory of the import of {size / 1e9:g} GB", style="dim")
            rows.append(_measure_import(Path(name), shape_zyx, size))
    return rows


def _measure_import(folder: Path, shape_zyx: tuple[int, int, int], size: int) -> MemoryRow:
    raw, scene, draft = folder / "large.raw", folder / "large.toml", folder / "large.volpkg"
    raw.touch()
    os.truncate(raw, size)
    scene.write_text(_SCENE.format(*shape_zyx), encoding="utf-8")
    row = _measure(f"import of {size / 1e9:g} GB of raw voxels", "import", scene, "-o", draft)
    shutil.rmtree(draft)
    return row


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
