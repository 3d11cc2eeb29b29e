"""The segments of a scan, read and fitted to it: a label for each of its voxels, and what each label means."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np

from volprep.scan.segments.contours import covered_slices, steps_of
from volprep.scan.segments.onto_grid import contours_outside, difference, onto_grid
from volprep.scan.segments.planes import OffPlane, Planes, planes_of
from volprep_formats.arrays import Float64Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.progress import Progress
from volprep_formats.segmentations.overlaps import Members, Overlaps, count_of
from volprep_formats.segmentations.records import (
    Contours,
    LabelArray,
    LabelVolume,
    ScanFrame,
    SourceSegment,
    numbers_text,
)

_SAME = 1e-3
"""How far beyond the faces of a scan a point may lie that still counts as inside, in voxels."""


def contours_beyond(rings: Sequence[Sequence[Float64Array]], scan: Grid) -> tuple[str, ...]:
    """Say how many contours, each [points, (x, y, z)] in millimetres, have a point outside the scan."""
    each = [ring for own in rings for ring in own]
    off_mm = [float(_off_mm(ring, scan).max()) for ring in each]
    beyond = [distance for distance in off_mm if distance > 0.0]
    if not beyond:
        return ()
    verb = "reaches" if len(beyond) == 1 else "reach"
    told = f"{len(beyond)} of {len(each)} contours {verb} beyond the scan, by up to {max(beyond):.4g} mm"
    return (f"{told}; the part beyond it is left out",)


def voxels_beyond(labels: LabelArray, grid: Grid, scan: Grid) -> tuple[str, ...]:
    """Say how many voxels with a label, [z, y, x] on `grid`, have their centres outside the scan."""
    places = grid.world_from_index
    corners = np.array(list(product(*((0.0, n - 1.0) for n in grid.shape_zyx[::-1]))))
    if not _off_mm(corners @ places[:3, :3].T + places[:3, 3], scan).any():
        return ()
    count = beyond = 0
    farthest_mm = 0.0
    for z, plane in enumerate(labels):
        y, x = np.nonzero(plane)
        count += len(x)
        if len(x):
            points = np.stack([x, y, np.full(len(x), z)], axis=1) @ places[:3, :3].T + places[:3, 3]
            off_mm = _off_mm(points, scan)
            beyond += int(np.count_nonzero(off_mm))
            farthest_mm = max(farthest_mm, float(off_mm.max()))
    if not beyond:
        return ()
    told = f"{beyond / count:.2%} of the voxels of segments lie beyond the scan, up to {farthest_mm:.4g} mm"
    return (f"{told}; they are left out",)


def _off_mm(points_xyz: Float64Array, scan: Grid) -> Float64Array:
    """Return how far points [n, (x, y, z)] in millimetres lie outside the box of a scan; 0 inside."""
    from_world = np.linalg.inv(scan.world_from_index)
    place = points_xyz @ from_world[:3, :3].T + from_world[:3, 3]
    last = np.array(scan.shape_zyx[::-1]) - 1.0
    over = np.maximum(place - last, -place) - 0.5
    spacing_mm = np.array(scan.spacing_mm_zyx[::-1])
    off_mm: Float64Array = np.linalg.norm(np.where(over > _SAME, over, 0.0) * spacing_mm, axis=1)
    return off_mm


_HALF = 0.5
_MOST_STEPS = 2**33
"""A minute of one processor. A hundred structures that each fill a hundred slices of 512×512 pixels take 2^32.6."""
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
    members: Members
    segments: tuple[SourceSegment, ...]
    """All segments of the source."""
    volumes_ml: tuple[float, ...]
    """Of each segment, as its source has it."""
    remarks: tuple[str, ...]
    """Remarks for the user."""


def fitted_segments(path: Path, grid: Grid, frame: ScanFrame, progress: Progress) -> Fitted:
    """Read the segmentation at `path` and bring it onto the grid of a scan.

    `frame` is that of the scan. Contours that name another one, but are all drawn on images of the scan, are in its
    frame: writers of structure sets are known to invent one. Raises what `open_segmentation` raises, VP1410 (another
    frame of reference), VP1411 (another place), VP1412 (contours off the slices), VP1413 and VP3290 (overlaps) and
    VP3291 (intricate contours).
    """
    from volprep_formats.segmentations import open_segmentation  # noqa: PLC0415 - loads readers of DICOM

    found = open_segmentation(path, progress, grid, frame)
    own = found.frame_of_reference
    is_other = bool(own and frame.uid and own != frame.uid)
    is_drawn_on_scan = isinstance(found, Contours) and bool(found.images) and found.images <= frame.images
    if is_other and not is_drawn_on_scan:
        raise VolprepError("VP1410", path=path, own=own[-_UID_ENDING:], scan=frame.uid[-_UID_ENDING:])
    if isinstance(found, LabelVolume):
        return _of_voxels(path, found, grid, same_frame=bool(own and frame.uid))
    fitted = _of_contours(path, found, grid)
    return replace(fitted, remarks=(_DRAWN_ON_SCAN, *fitted.remarks)) if is_other else fitted


def _of_voxels(path: Path, found: LabelVolume, grid: Grid, *, same_frame: bool) -> Fitted:
    """Bring labels onto the grid of a scan. Raises VP1411."""
    from volprep_formats.segmentations.mask_folder import described  # noqa: PLC0415 - loads readers of DICOM

    boxes = {"own": described(found.grid), "scan": described(grid)}
    problem = difference(found.grid, grid, same_frame=same_frame)
    if problem:
        raise VolprepError("VP1411", path=path, difference=problem, **boxes)
    counts = count_of(found.labels, len(found.members))
    volumes = np.zeros(len(found.segments))
    for members, count in zip(found.members, counts.tolist(), strict=True):
        volumes[list(members)] += count * _voxel_ml(found.grid)
    labels = onto_grid(found.labels, found.grid, grid)
    beyond = voxels_beyond(found.labels, found.grid, grid)
    if counts[1:].any() and not labels.any():
        problem = "; ".join(("no segment has a voxel of the scan", *beyond))
        raise VolprepError("VP1411", path=path, difference=problem, **boxes)
    return Fitted(labels, found.members, found.segments, tuple(volumes.tolist()), (*found.remarks, *beyond))


def _of_contours(path: Path, found: Contours, grid: Grid) -> Fitted:
    """Rasterise contours on the grid of a scan. Raises VP1411 to VP1413, VP3290 and VP3291."""
    from volprep_formats.segmentations.mask_folder import described  # noqa: PLC0415 - loads readers of DICOM

    problem = contours_outside(found.rings, grid)
    if problem:
        raise VolprepError("VP1411", path=path, difference=problem, own=_box_of(found), scan=described(grid))
    planes = _planes(path, found, grid)
    distances = _distances(planes)
    steps = sum(steps_of(plane, distances[index], grid.shape_zyx) for index, plane in planes.items())
    if steps > _MOST_STEPS:
        raise VolprepError("VP3291", path=path, work=steps, most=_MOST_STEPS)
    overlaps = Overlaps(path, grid.shape_zyx, len(found.segments))
    volumes = np.zeros(len(found.segments))
    for index, plane in planes.items():
        for covered in covered_slices(plane, distances[index], grid.shape_zyx):
            volumes[index] += float(covered.share.sum()) * _voxel_ml(grid)
            own = (covered.share >= _HALF) * np.uint16(index + 1)
            overlaps.add(covered.place, own, 2 - plane.axis, covered.corner)
    remarks = (*found.remarks, *_thickness(found, planes, distances, grid), *contours_beyond(found.rings, grid))
    return Fitted(*overlaps.combined(), found.segments, tuple(volumes.tolist()), remarks)


def _planes(path: Path, found: Contours, grid: Grid) -> dict[int, Planes]:
    """Return the planes of each segment that has contours, by its index. Raises VP1412."""
    planes = {}
    for index, rings in enumerate(found.rings):
        if not rings:
            continue
        each = planes_of(rings, found.items[index], grid)
        if isinstance(each, OffPlane):
            number = found.segments[index].number
            fields = {"contour": each.contour, "off_mm": each.off_mm, "angle": each.angle_deg}
            raise VolprepError("VP1412", path=path, number=number, **fields)
        planes[index] = each
    return planes


def _distances(planes: dict[int, Planes]) -> dict[int, float]:
    """Return the usual distance of the planes of each segment, in slices.

    Segments of a plane or two have that of the others, or else that of the slices.
    """
    own = {index: stack.usual_distance for index, stack in planes.items()}
    known = sorted(distance for distance in own.values() if distance is not None)
    others = known[(len(known) - 1) // 2] if known else 1.0
    return {index: others if distance is None else distance for index, distance in own.items()}


def _thickness(found: Contours, planes: dict[int, Planes], distances: dict[int, float], grid: Grid) -> tuple[str, ...]:
    """Say which slab of the scan a contour fills, and which gaps stay empty."""
    reach_mm = [distances[index] / 2 * grid.spacing_mm_zyx[2 - stack.axis] for index, stack in planes.items()]
    least, most = f"{min(reach_mm):.4g}", f"{max(reach_mm):.4g}"
    reach = least if least == most else f"{least} to {most}"
    holes = [found.segments[index].number for index, stack in planes.items() if stack.holes(distances[index])]
    gaps = f", and gaps that are not filled: segments {numbers_text(holes)}" if holes else ""
    return (f"contours reach half-way to the next plane, and {reach} mm beyond the first and the last one{gaps}",)


def _box_of(contours: Contours) -> str:
    """Say in one line where contours lie."""
    points = np.concatenate([ring for rings in contours.rings for ring in rings])
    low, high = (", ".join(f"{x:.4g}" for x in ends) for ends in (points.min(axis=0), points.max(axis=0)))
    return f"contours from ({low}) to ({high}) mm"


def _voxel_ml(grid: Grid) -> float:
    z, y, x = grid.spacing_mm_zyx
    return z * y * x / 1000.0
