"""Channels of a scan: opened one by one, on the grid of the first one, or on a grid of their own in the same space."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
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
from volprep_formats.source import ChannelSpec, SourceInfo, SourceSpec, VolumeSource

REGISTERED_VOXELS = 0.01
"""Corners of two channels may lie apart by this part of the smallest spacing. Programs that resample one volume onto
the grid of another write its affine in single precision, which is a thousandth of a voxel off at most."""


_PLACED = frozenset({"dicom", "nifti", "nrrd", "metaimage", "mgh", "minc", "mrtrix"})
"""Formats whose files say where the voxels are in the patient's space."""
_UID_ENDING = 16
"""Digits of a UID in a message."""


@dataclass(frozen=True)
class FirstChannel:
    """The channel whose space is that of the package."""

    name: str
    """Its name."""
    spec: SourceSpec
    """Its source."""
    info: SourceInfo
    """Header of its source."""


@contextmanager
def opened_channel(spec: SourceSpec, progress: Progress) -> Iterator[VolumeSource]:
    """Open a channel. Raises the errors of the reader, and VP1287 and VP3026 as `_meant` does."""
    with _meant(spec, progress) as source:
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


def grid_in_common(name: str, spec: SourceSpec, info: SourceInfo, first: FirstChannel, progress: Progress) -> Grid:
    """Return the grid of a channel: that of the first one if both have the same voxels, else its own.

    Voxels are the same within REGISTERED_VOXELS at the corners. Raises VP1240 for another grid in a space that is not
    known to be that of the first channel.
    """
    if isinstance(spec, ChannelSpec) and spec.transform is not None:
        return info.grid
    difference = _difference(info.grid, first.info.grid)
    if not difference:
        return first.info.grid
    if problem := _other_space(spec, info, first, progress):
        told = f"{difference}, and {problem}"
        raise VolprepError("VP1240", path=spec.path, name=name, first=first.name, difference=told)
    return info.grid


def _other_space(spec: SourceSpec, info: SourceInfo, first: FirstChannel, progress: Progress) -> str:
    """Say why two channels are not known to lie in one space; nothing if they do."""
    unplaced = [described.format for described in (info, first.info) if described.format not in _PLACED]
    if unplaced:
        return f"{unplaced[0]} files do not say where voxels lie"
    if {info.format, first.info.format} != {"dicom"}:
        return ""
    from volprep_formats.readers.dicom.frame import frame_of_scan  # noqa: PLC0415 - which loads pydicom

    own, other = (frame_of_scan(value, progress).uid for value in (spec, first.spec))
    if own and own == other:
        return ""
    texts = [f"…{uid[-_UID_ENDING:]}" if uid else "none" for uid in (own, other)]
    return f"their frames of reference are {texts[0]} and {texts[1]}"


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
