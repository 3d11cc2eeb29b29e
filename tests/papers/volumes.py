"""The volumes of the papers' tables: real scans, and smaller ones made of them.

Scans are those of VOLPREP_TEST_DATA; where there are none, the brain that `make demo` fetches stands for all of them.
"""

import os
import sys
import tomllib
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import zoom

from tests.benchmarks.real_scans import SCANS, have_scans
from volprep.scan.channels import opened_channel
from volprep_formats.grid import Grid
from volprep_formats.progress import Silent
from volprep_formats.source import SourceInfo, SourceSpec
from volprep_formats.writers import nrrd

_TOOLS = Path(__file__).parent.parent.parent / "tools"


@dataclass(frozen=True, eq=False)
class Volume:
    """Voxels, as a source of a package."""

    word: str
    """Which scan it is made of."""
    what: str
    """What was made of the scan: its size in voxels."""
    stored: NDArray[np.generic]
    """Voxels [z, y, x]."""
    info: SourceInfo
    """Where they are, and what they mean."""

    @property
    def name(self) -> str:
        """Scan and size."""
        return f"{self.word}, {self.what}"

    def reduced(self, factor: int) -> Self:
        """Return means of so many voxels along each axis; what is left over at the ends is left out."""
        z, y, x = (n // factor for n in self.stored.shape)
        whole = self.stored[: z * factor, : y * factor, : x * factor]
        means = whole.reshape(z, factor, y, factor, x, factor).mean(axis=(1, 3, 5))
        grid = self.info.grid.part((0, 0, 0), whole.shape).coarser((factor, factor, factor))
        return self._made(_size(means.shape), means, grid)

    def resized(self, shape_zyx: tuple[int, int, int]) -> Self:
        """Return the same box with so many voxels along each axis."""
        grid = self.info.grid
        factors = [n / old for n, old in zip(shape_zyx, grid.shape_zyx, strict=True)]
        stored = zoom(self.stored.astype(np.float32), factors, order=1, grid_mode=True, mode="nearest")
        z, y, x = (h / f for h, f in zip(grid.spacing_mm_zyx, factors, strict=True))
        first = grid.corner_mm_xyz + np.array(grid.direction) @ (np.array([x, y, z]) / 2)
        return self._made(_size(stored.shape), stored, Grid.of(stored.shape, (z, y, x), first, grid.direction))

    def middle(self, voxels: int) -> Self:
        """Return the cube of so many voxels in the middle."""
        z, y, x = (max(0, (n - voxels) // 2) for n in self.stored.shape)
        part = self.stored[z : z + voxels, y : y + voxels, x : x + voxels]
        grid = self.info.grid.part((z, y, x), (z + part.shape[0], y + part.shape[1], x + part.shape[2]))
        return self._made(f"{_size(part.shape)} of the middle", part, grid)

    def write(self, path: Path) -> None:
        """Write it as an NRRD file."""
        nrrd.write(_Source(self), path, Silent())

    def _made(self, what: str, stored: NDArray[np.generic], grid: Grid) -> Self:
        kept = np.rint(stored).astype(self.stored.dtype) if self.stored.dtype.kind in "iu" else stored
        info = self.info.model_copy(update={"grid": grid})
        return type(self)(self.word, what, np.ascontiguousarray(kept, self.stored.dtype), info)


class _Source:
    """A volume as the writers take it."""

    def __init__(self, volume: Volume) -> None:
        self.info = volume.info
        self._stored = volume.stored

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        return self._stored[z0:z1]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        return None


@cache
def scan(name: str) -> Volume:
    """Return one of SCANS; the demo's brain where there is no folder of scans."""
    text, word = f"path = '{_fetched()}'", "MNI brain"
    if have_scans():
        text, word = SCANS[name].format(os.environ["VOLPREP_TEST_DATA"]), name
    with opened_channel("scan", SourceSpec.model_validate(tomllib.loads(text)), None, Silent()) as source:
        info = source.info
        stored = np.ascontiguousarray(source.read_slab(0, info.grid.shape_zyx[0]))
    return Volume(word, _size(stored.shape), stored, info)


def _size(shape_zyx: tuple[int, ...]) -> str:
    return "×".join(map(str, reversed(shape_zyx)))


def _fetched() -> Path | None:
    if have_scans():
        return None
    sys.path.append(str(_TOOLS))
    from fetch_scan import BRAIN, fetch

    return fetch(BRAIN)
