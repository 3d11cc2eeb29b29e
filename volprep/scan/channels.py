"""Channels of a scan: opened one by one, and refused if their grid differs from that of the first."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from itertools import product
from pathlib import Path

import numpy as np

from volprep.scan.outside import MeantSource
from volprep.scan.relabelled import with_small_labels
from volprep.scan.repair import open_scan
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.progress import Progress
from volprep_formats.readers import open_source
from volprep_formats.source import SourceSpec, VolumeSource

REGISTERED_VOXELS = 0.01
"""Corners of two channels may lie apart by this part of the smallest spacing. Programs that resample one volume onto
the grid of another write its affine in single precision, which is a thousandth of a voxel off at most."""


@contextmanager
def opened_channel(
    name: str, spec: SourceSpec, first: tuple[str, Grid] | None, progress: Progress
) -> Iterator[VolumeSource]:
    """Open a channel; `first` is the name and grid of the one that it must be registered with.

    Raises VP1240 when its voxels lie elsewhere, and the errors of the reader.
    """
    with _meant(spec, progress) as source:
        if first is not None:
            check_registered(name, spec, source.info.grid, *first)
        yield source


def _meant(spec: SourceSpec, progress: Progress) -> VolumeSource:
    """Open a source with its mask and with the scene's settings for labels and for NaN or infinite voxels.

    Raises VP1287 for a mask whose voxels lie elsewhere, VP3026 for more labels than there are codes.
    """
    source = open_scan(spec, Path("/"), progress)
    with ExitStack() as opened:
        opened.enter_context(source)
        mask: VolumeSource | None = None
        if spec.mask is not None:
            mask = opened.enter_context(open_source(SourceSpec(path=spec.mask), Path("/"), progress))
            if difference := _difference(mask.info.grid, source.info.grid):
                raise VolprepError("VP1287", path=spec.mask, difference=difference)
        if spec.mask is not None or spec.nan is not None:
            source = MeantSource(spec, source, mask, progress)
        if spec.labels:
            source = with_small_labels(source, progress)
        opened.pop_all()
        return source


def check_registered(name: str, spec: SourceSpec, grid: Grid, first_name: str, first: Grid) -> None:
    """Raise VP1240 unless both grids have the same voxels, within REGISTERED_VOXELS at the corners."""
    if difference := _difference(grid, first):
        raise VolprepError("VP1240", path=spec.path, name=name, first=first_name, difference=difference)


def _difference(grid: Grid, first: Grid) -> str:
    """Say how the voxels of two grids differ; nothing if they are the same."""
    if grid.shape_zyx != first.shape_zyx:
        sizes = ["×".join(str(n) for n in reversed(shape)) for shape in (grid.shape_zyx, first.shape_zyx)]
        return f"it has {sizes[0]} voxels instead of {sizes[1]}"
    corners = np.array(list(product(*((0, n - 1) for n in grid.shape_zyx[::-1]), (1,))), dtype=np.float64)
    apart = corners @ (grid.world_from_index - first.world_from_index)[:3].T
    most_mm = float(np.linalg.norm(apart, axis=1).max())
    # One voxel along an axis has no second corner to show another spacing.
    most_mm = max(most_mm, *(abs(a - b) for a, b in zip(grid.spacing_mm_zyx, first.spacing_mm_zyx, strict=True)))
    limit_mm = REGISTERED_VOXELS * min(first.spacing_mm_zyx)
    return "" if most_mm <= limit_mm else f"voxels lie up to {most_mm:.4g} mm apart, and {limit_mm:.4g} mm are allowed"
