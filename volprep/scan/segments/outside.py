"""Count the parts of a segmentation that lie beyond the scan, for a note to the user."""

from collections.abc import Sequence
from itertools import product

import numpy as np

from volprep_formats.arrays import Float64Array
from volprep_formats.grid import Grid
from volprep_formats.segmentations.records import LabelArray

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
