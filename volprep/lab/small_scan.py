"""The scan that curves are measured on: the scan itself, or, of a large one, means of its voxels, as a file."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from volprep.scan.channels import opened_channel
from volprep.truth.lit import Normals
from volprep.truth.volume import Volume
from volprep_formats.arrays import Float64Array
from volprep_formats.opened_source import OpenedSource
from volprep_formats.progress import Progress, Silent
from volprep_formats.source import SourceSpec, VolumeSource
from volprep_formats.writers import nrrd

MOST_VOXELS = 2_000_000
"""Curves of so many voxels take minutes, not hours: some ninety packages are built."""


class _Means(OpenedSource):
    """A source whose voxels are means of another one's, or, of labels, every so many of them."""

    def __init__(self, source: VolumeSource, factor: int, *, labels: bool) -> None:
        self._source = source
        self._factor = factor
        self._labels = labels
        grid = source.info.grid.coarser((factor, factor, factor))
        super().__init__(source.info.model_copy(update={"grid": grid}))

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        factor, shape = self._factor, self._source.info.grid.shape_zyx
        voxels = self._source.read_slab(z0 * factor, min(z1 * factor, shape[0]))
        if self._labels:
            return np.ascontiguousarray(voxels[::factor, ::factor, ::factor])
        padded = np.pad(voxels, [(0, -n % factor) for n in voxels.shape], mode="edge")
        z, y, x = (n // factor for n in padded.shape)
        means: Float64Array = padded.reshape(z, factor, y, factor, x, factor).mean(axis=(1, 3, 5), dtype=np.float64)
        rounded: NDArray[np.generic] = (np.rint(means) if voxels.dtype.kind in "iu" else means).astype(voxels.dtype)
        return rounded


def write_scan(
    spec: SourceSpec, path: Path, progress: Progress, most_voxels: int | None = None
) -> tuple[SourceSpec, int]:
    """Write the scan, or means of its voxels, at most MOST_VOXELS, to the NRRD file `path`.

    Return the source that reads it, and the number of voxels along each axis that one mean covers.
    """
    with opened_channel(spec, progress) as source:
        voxels = int(np.prod(source.info.grid.shape_zyx))
        factor = max(1, int(np.ceil((voxels / (most_voxels or MOST_VOXELS)) ** (1 / 3) - 1e-6)))
        progress.start("scan for variants", -(-source.info.grid.shape_zyx[0] // factor))
        nrrd.write(_Means(source, factor, labels=bool(spec.labels)), path, progress)
    return SourceSpec(path=str(path), format="nrrd", labels=bool(spec.labels)), factor


def read_scan(spec: SourceSpec, light: Normals) -> Volume:
    """Read a whole scan; `light` is its lighting."""
    with opened_channel(spec, Silent()) as source:
        info = source.info
        stored = source.read_slab(0, info.grid.shape_zyx[0])
    return Volume(np.ascontiguousarray(stored), info.grid, info.slope, info.intercept, bool(spec.labels), light)
