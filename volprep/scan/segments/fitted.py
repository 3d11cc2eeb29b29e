"""The segments of a scan, read and fitted to it: a label for each of its voxels, and what each label means."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from volprep.scan.segments.combine import LabelArray, combine, count_of
from volprep.scan.segments.contours import OffPlane, coverage_of
from volprep.scan.segments.onto_grid import contours_outside, difference, onto_grid
from volprep.scan.segments.outside import contours_beyond, voxels_beyond
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.progress import Progress
from volprep_formats.segmentations.layers import LayerStack
from volprep_formats.segmentations.records import Contours, LabelLayers, LayerArray, ScanFrame, SourceSegment

_HALF = 0.5
_UID_ENDING = 12
_DRAWN_ON_SCAN = (
    "the contours state another frame of reference than the scan, but are drawn on its images; they are taken to lie "
    "in the frame of the scan"
)


@dataclass(frozen=True)
class Fitted:
    """Segments on the grid of a scan."""

    labels: LabelArray
    """[z, y, x]; 0 is no segment."""
    members: tuple[tuple[int, ...], ...]
    """For each label from 0: indices of its segments."""
    segments: tuple[SourceSegment, ...]
    """All segments of the source."""
    volumes_ml: tuple[float, ...]
    """Of each segment, as its source has it."""
    remarks: tuple[str, ...]
    """Remarks for the user."""


def fitted_segments(path: Path, grid: Grid, frame: ScanFrame, progress: Progress) -> Fitted:
    """Read the segmentation at `path` and bring it onto the grid of a scan.

    `frame` is that of the scan. Contours that name another one, but are drawn on images of the scan, are in its frame:
    writers of structure sets are known to invent one. Raises what `open_segmentation` raises, VP1410 (another frame of
    reference), VP1411 (another place), VP1412 (contours off the slices) and VP1413 (too many labels).
    """
    from volprep_formats.segmentations import open_segmentation  # noqa: PLC0415 - loads readers of DICOM
    from volprep_formats.segmentations.mask_folder import described  # noqa: PLC0415 - loads readers of DICOM

    found = open_segmentation(path, progress, grid)
    own = found.frame_of_reference
    is_other = bool(own and frame.uid and own != frame.uid)
    is_drawn_on_scan = isinstance(found, Contours) and bool(found.images & frame.images)
    if is_other and not is_drawn_on_scan:
        raise VolprepError("VP1410", path=path, own=own[-_UID_ENDING:], scan=frame.uid[-_UID_ENDING:])
    if isinstance(found, Contours):
        problem = contours_outside(found.rings, grid)
        if problem:
            raise VolprepError("VP1411", path=path, difference=problem, own=_box_of(found), scan=described(grid))
        layers, volumes = _masks(path, found, grid)
        combined = combine(path, layers)
        remarks = (*found.remarks, *((_DRAWN_ON_SCAN,) if is_other else ()), *contours_beyond(found.rings, grid))
        return Fitted(combined.labels, combined.members, found.segments, volumes, remarks)
    boxes = {"own": described(found.grid), "scan": described(grid)}
    problem = difference(found.grid, grid, same_frame=bool(own and frame.uid))
    if problem:
        raise VolprepError("VP1411", path=path, difference=problem, **boxes)
    combined = combine(path, found.layers)
    labels = onto_grid(combined.labels, found.grid, grid)
    beyond = voxels_beyond(combined.labels, found.grid, grid)
    if combined.labels.any() and not labels.any():
        problem = "; ".join(("no segment has a voxel of the scan", *beyond))
        raise VolprepError("VP1411", path=path, difference=problem, **boxes)
    return Fitted(labels, combined.members, found.segments, _volumes(found), (*found.remarks, *beyond))


def _box_of(contours: Contours) -> str:
    """Say in one line where contours lie."""
    points = np.concatenate([ring for rings in contours.rings for ring in rings])
    low, high = (", ".join(f"{x:.4g}" for x in ends) for ends in (points.min(axis=0), points.max(axis=0)))
    return f"contours from ({low}) to ({high}) mm"


def _masks(path: Path, contours: Contours, grid: Grid) -> tuple[tuple[LayerArray, ...], tuple[float, ...]]:
    layers = LayerStack(path, grid.shape_zyx)
    volumes = []
    voxel_ml = _voxel_ml(grid)
    for index, rings in enumerate(contours.rings):
        if not rings:
            volumes.append(0.0)
            continue
        share = coverage_of(rings, grid)
        if isinstance(share, OffPlane):
            number = contours.segments[index].number
            fields = {"contour": share.contour, "off_mm": share.off_mm, "angle": share.angle_deg}
            raise VolprepError("VP1412", path=path, number=number, **fields)
        volumes.append(float(share.sum()) * voxel_ml)
        layers.add(index + 1, share >= _HALF)
    return layers.arrays, tuple(volumes)


def _volumes(layers: LabelLayers) -> tuple[float, ...]:
    count = sum(count_of(layer, len(layers.segments) + 1) for layer in layers.layers)
    return tuple((np.asarray(count)[1:] * _voxel_ml(layers.grid)).tolist())


def _voxel_ml(grid: Grid) -> float:
    z, y, x = grid.spacing_mm_zyx
    return z * y * x / 1000.0
