"""Import of DICOM series, from a folder of files to one file of voxels: volprep, dcm2niix and SimpleITK's reader.

Two ways: each as a person would start it, in a process of its own; and in a process that runs already, as one that
imports many series, where the second import counts. dcm2niix starts in milliseconds, so that its command is the measure
of both. All run in turn, round after round; the best round counts. Python finds its modules compiled, as it does where
a package is installed.

volprep also measures the values and makes the digest that names the scan, and does not return before all of it is safe
on the disk. A third way is without these three, and says what they cost. What Python and the libraries take to start,
which no import can be faster than, stands beside the command.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from volprep_formats.grid import Grid
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.source import SourceInfo, SourceSpec
from volprep_formats.writers import dicom

from .real_scans import scans_folder

ROUNDS = 5
LARGE_ZYX = (400, 512, 512)
_OURS = "from volprep_cli.main import main; main()"
_OURS_RUNNING = """
import shutil, sys, time
from pathlib import Path
from volprep.pipeline.import_draft import import_draft
from volprep.pipeline.prepare import prepare
from volprep.scene.request import request_for_source
from volprep_formats.progress import Silent
for _ in range(2):
    shutil.rmtree(sys.argv[2], ignore_errors=True)
    start = time.perf_counter()
    import_draft(prepare(request_for_source(Path(sys.argv[1]))), Path(sys.argv[2]), Silent())
    print(time.perf_counter() - start)
"""
_OURS_BARE = (
    """
import hashlib, os
import numpy as np
from volprep.scan.statistics import SlabMeasurer, _Sampler
class NoDigest:
    def __init__(self, data=b""): pass
    def update(self, data): pass
    def hexdigest(self): return "0" * 64
measured = SlabMeasurer.add
SlabMeasurer.add = lambda gauge, slab: None if gauge._slices else measured(gauge, slab)
_Sampler.rays_zyx = _Sampler.pairs_zyx = lambda sampler, slope, intercept: (np.zeros((1, 1)),) * 3
hashlib.sha256 = NoDigest
os.fsync = lambda descriptor: None
"""
    + _OURS_RUNNING
)
_LIBRARIES = "import numpy, pydantic.main, typer"
_SIMPLEITK = """
import sys, SimpleITK
reader = SimpleITK.ImageSeriesReader()
reader.SetFileNames(reader.GetGDCMSeriesFileNames(sys.argv[1]))
SimpleITK.WriteImage(reader.Execute(), sys.argv[2])
"""
_SIMPLEITK_RUNNING = """
import os, sys, time, SimpleITK
for _ in range(2):
    if os.path.exists(sys.argv[2]):
        os.unlink(sys.argv[2])
    start = time.perf_counter()
    reader = SimpleITK.ImageSeriesReader()
    reader.SetFileNames(reader.GetGDCMSeriesFileNames(sys.argv[1]))
    SimpleITK.WriteImage(reader.Execute(), sys.argv[2])
    print(time.perf_counter() - start)
"""


@dataclass(frozen=True)
class ImportRow:
    """One series, imported by volprep in one way, and by one other."""

    series: str
    """Its size, x×y×z."""
    how: str
    """"command", where what it takes to start counts too, "running", or "running, bare"."""
    ours_s: float
    """Our best time."""
    peer: str
    """Who else does it; or the start of the libraries alone."""
    peer_s: float
    """Its best time."""
    ratio: float
    """How many times its time we take."""


class _Resampled:
    """A larger volume made of a smaller one: each voxel is that of the nearest place."""

    def __init__(self, voxels: NDArray[np.int16]) -> None:
        self._voxels = voxels
        self._places = [np.arange(n) * m // n for n, m in zip(LARGE_ZYX, voxels.shape, strict=True)]
        grid = Grid.of(LARGE_ZYX, (0.5, 0.5, 0.5))
        self.info = SourceInfo(format="raw", grid=grid, stored_type="int16", modality="MR")

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        z, y, x = self._places
        return self._voxels[z[z0:z1]][:, y][:, :, x]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        pass


def measure_import(console: Console) -> Iterator[ImportRow]:
    """Measure the head MR among the real scans, and a series of 512×512×400 made of it."""
    scan = scans_folder() / "mr_t1_studyforrest"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with open_source(SourceSpec(path=str(scan)), Path(), Silent()) as source:
            voxels = source.read_slab(0, source.info.grid.shape_zyx[0]).astype(np.int16)
        dicom.write(_Resampled(voxels), folder / "large", Silent())
        for series, shape_zyx in ((scan, voxels.shape), (folder / "large", LARGE_ZYX)):
            size = "×".join(str(n) for n in reversed(shape_zyx))
            console.print(f"measuring import of {size}", style="dim")
            yield from _contest(size, series, folder / "out")


def import_table(rows: list[ImportRow]) -> Table:
    """Table for people."""
    table = Table("import of DICOM", "how", "ours s", "peer", "peer s", "ours ÷ peer")
    for row in rows:
        table.add_row(row.series, row.how, f"{row.ours_s:.2f}", row.peer, f"{row.peer_s:.2f}", f"{row.ratio:.2f}")
    return table


def _contest(size: str, series: Path, out: Path) -> list[ImportRow]:
    files = max({file.parent for file in series.rglob("*")}, key=lambda parent: len(list(parent.iterdir())))
    python = (sys.executable, "-c")
    commands: dict[str, Sequence[str | Path]] = {
        "volprep": [*python, _OURS, "import", series, "-o", out / "x.volpkg"],
        "SimpleITK": [*python, _SIMPLEITK, files, out / "x.nii"],
        "its libraries": [*python, _LIBRARIES],
    }
    if shutil.which("dcm2niix"):
        commands["dcm2niix"] = ["dcm2niix", "-z", "n", "-b", "n", "-f", "x", "-o", out, series]
    running: dict[str, Sequence[str | Path]] = {
        "volprep": [*python, _OURS_RUNNING, series, out / "x.volpkg"],
        "volprep, bare": [*python, _OURS_BARE, series, out / "x.volpkg"],
        "SimpleITK": [*python, _SIMPLEITK_RUNNING, files, out / "x.nii"],
    }
    best = dict.fromkeys(commands, float("inf"))
    best_running = dict.fromkeys(running, float("inf"))
    compiled = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    compiled["PYTHONPYCACHEPREFIX"] = str(out.with_name("compiled"))
    for _ in range(ROUNDS):
        for who, command in commands.items():
            out.mkdir()
            start = time.perf_counter()
            subprocess.run(command, check=True, capture_output=True, env=compiled)
            best[who] = min(best[who], time.perf_counter() - start)
            shutil.rmtree(out)
        for who, command in running.items():
            out.mkdir()
            told = subprocess.run(command, check=True, capture_output=True, text=True, env=compiled).stdout
            best_running[who] = min(best_running[who], float(told.split()[-1]))
            shutil.rmtree(out)
    rows = [("command", best["volprep"], peer, best[peer]) for peer in best if peer != "volprep"]
    for how, ours_s in (("running", best_running["volprep"]), ("running, bare", best_running["volprep, bare"])):
        peers = {"SimpleITK": best_running["SimpleITK"], **{name: best[name] for name in best if name == "dcm2niix"}}
        rows += [(how, ours_s, peer, seconds) for peer, seconds in peers.items()]
    return [ImportRow(size, how, ours_s, peer, peer_s, ours_s / peer_s) for how, ours_s, peer, peer_s in rows]
