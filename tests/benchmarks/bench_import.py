"""Import of DICOM series, from a folder of files to one file of voxels: volprep, dcm2niix and SimpleITK's reader.

Each runs as a person would start it, in a process of its own, in turn, round after round; the best round counts. What
volprep needs to start is measured too: a process that imports many series pays it once. volprep also measures the
values and makes the digest that names the scan.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray
from rich.console import Console

from volprep_formats.dicom_series import write_series
from volprep_formats.grid import Grid
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.source import SourceInfo, SourceSpec

ROUNDS = 5
LARGE_ZYX = (400, 512, 512)
_OURS = "from volprep_cli.main import main; main()"
_START = "import volprep_cli.main, volprep.drafts, volprep.repair, volprep_formats.readers.dicom"
_SIMPLEITK = """
import sys, SimpleITK
reader = SimpleITK.ImageSeriesReader()
reader.SetFileNames(reader.GetGDCMSeriesFileNames(sys.argv[1]))
SimpleITK.WriteImage(reader.Execute(), sys.argv[2])
"""


@dataclass(frozen=True)
class ImportRow:
    """One series, imported by volprep and by one other."""

    series: str
    """Its size, x×y×z."""
    ours_s: float
    """Our best time, in a process of its own."""
    ours_started_s: float
    """The same without what it takes to start Python and to load the libraries."""
    peer: str
    """Who else does it."""
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


def measure_import(console: Console) -> list[ImportRow]:
    """Measure the head MR among the real scans, and a series of 512×512×400 made of it; nothing where there is none."""
    scan = Path(os.environ.get("VOLPREP_TEST_DATA", "")) / "mr_t1_studyforrest"
    if not scan.is_dir():
        console.print("import is not measured: no real scans, VOLPREP_TEST_DATA names none", style="dim")
        return []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with open_source(SourceSpec(path=str(scan)), Path(), Silent()) as source:
            voxels = source.read_slab(0, source.info.grid.shape_zyx[0]).astype(np.int16)
        write_series(_Resampled(voxels), folder / "large", progress=Silent())
        rows = []
        for series, shape_zyx in ((scan, voxels.shape), (folder / "large", LARGE_ZYX)):
            size = "×".join(str(n) for n in reversed(shape_zyx))
            console.print(f"measuring import of {size}", style="dim")
            rows += _contest(size, series, folder / "out")
    return rows


def _contest(size: str, series: Path, out: Path) -> list[ImportRow]:
    files = max({file.parent for file in series.rglob("*")}, key=lambda parent: len(list(parent.iterdir())))
    commands: dict[str, Sequence[str | Path]] = {
        "start": [sys.executable, "-c", _START],
        "volprep": [sys.executable, "-c", _OURS, "import", series, "-o", out / "x.volpkg"],
        "SimpleITK": [sys.executable, "-c", _SIMPLEITK, files, out / "x.nii"],
    }
    if shutil.which("dcm2niix"):
        commands["dcm2niix"] = ["dcm2niix", "-z", "n", "-b", "n", "-f", "x", "-o", out, series]
    best = dict.fromkeys(commands, float("inf"))
    for _ in range(ROUNDS):
        for who, command in commands.items():
            out.mkdir()
            start = time.perf_counter()
            subprocess.run(command, check=True, capture_output=True)
            best[who] = min(best[who], time.perf_counter() - start)
            shutil.rmtree(out)
    ours = best["volprep"]
    return [
        ImportRow(size, ours, ours - best["start"], peer, best[peer], ours / best[peer])
        for peer in commands
        if peer not in {"start", "volprep"}
    ]
