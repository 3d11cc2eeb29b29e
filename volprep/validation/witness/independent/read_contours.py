"""Contours of DICOM structure sets, with pydicom alone: the share of each voxel that they cover, by counting points.

Contours lie in slices of the scan. Those of one item fill by the even-odd rule, and items are united. A plane fills the
scan half-way to the next planes, and half the usual distance where none is near.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep.validation.witness.independent.scan import CannotWitnessError, Floats

_POINTS = 12
"""Points along each edge of a pixel."""
_SAME_PLANE = 1e-2
_IN_SLICE = 0.1
"""How far points of a contour may lie off its plane, in slices."""
_LIKE_USUAL = 0.1
_IN_GAP = 1.5
_CLOSED = frozenset(("CLOSED_PLANAR", "CLOSEDPLANAR_XOR"))


@dataclass(frozen=True)
class _Plane:
    """Contours of a segment at one place, by the item of the file that they are in."""

    centre: float
    items: Mapping[int, Sequence[Floats]]


def covered_voxels(file: Any, world_from_index: Floats, shape_zyx: Sequence[int]) -> Iterator[tuple[int, Floats]]:
    """Return number and covered share of each voxel [z, y, x], for each structure, ascending.

    Raises CannotWitnessError for contours that do not lie in slices.
    """
    drawn: dict[int, list[tuple[int, Floats]]] = {int(item.ROINumber): [] for item in file.StructureSetROISequence}
    index_from_world = np.linalg.inv(world_from_index)
    for place, item in enumerate(file.ROIContourSequence):
        for contour in item.get("ContourSequence") or ():
            points = np.array(contour.ContourData, dtype=np.float64).reshape(-1, 3)
            if str(contour.ContourGeometricType) in _CLOSED and len(points) > 2:
                ring = points @ index_from_world[:3, :3].T + index_from_world[:3, 3]
                drawn[int(item.ReferencedROINumber)].append((place, ring))
    planes = {number: _planes(rings) for number, rings in drawn.items() if rings}
    usual = {number: _usual(np.diff([plane.centre for plane in value])) for number, value in planes.items()}
    known = sorted(distance for distance in usual.values() if distance is not None)
    others = known[(len(known) - 1) // 2] if known else 1.0
    for number in sorted(planes):
        yield number, _filled(planes[number], usual[number] or others, shape_zyx)


def _planes(rings: Sequence[tuple[int, Floats]]) -> list[_Plane]:
    """Return the planes of a structure, ascending."""
    found: list[tuple[float, dict[int, list[Floats]]]] = []
    for item, ring in sorted(rings, key=lambda ring: float(ring[1][:, 2].mean())):
        if np.ptp(ring[:, 2]) > _IN_SLICE:
            raise CannotWitnessError("its contours do not lie in slices of the scan")
        centre = float(ring[:, 2].mean())
        if not found or centre - found[-1][0] > _SAME_PLANE:
            found.append((centre, {}))
        own = found[-1][1].setdefault(item, [])
        if not any(ring.shape == other.shape and np.allclose(ring[:, :2], other, atol=1e-6) for other in own):
            own.append(ring[:, :2])
    return [_Plane(centre, items) for centre, items in found]


def _usual(gaps: Floats) -> float | None:
    """Return the lower median of the gaps, if two gaps have it."""
    if len(gaps) < 2:
        return None
    usual = float(np.sort(gaps)[(len(gaps) - 1) // 2])
    return usual if (np.abs(gaps - usual) <= _LIKE_USUAL * usual).sum() > 1 else None


def _filled(planes: Sequence[_Plane], usual: float, shape_zyx: Sequence[int]) -> Floats:
    """Return the share of each voxel that the slabs of the planes cover."""
    share = np.zeros(shape_zyx)
    gaps = np.diff([plane.centre for plane in planes])
    halves = 0.5 * np.where(gaps > _IN_GAP * usual, usual, gaps)
    for plane, below, above in zip(planes, (0.5 * usual, *halves), (*halves, 0.5 * usual), strict=True):
        low, high = plane.centre - below, plane.centre + above
        inside = np.any([_inside(rings, shape_zyx[1:]) for rings in plane.items.values()], axis=0)
        height, width = shape_zyx[1:]
        covered = inside.reshape(height, _POINTS, width, _POINTS).mean(axis=(1, 3))
        for z in range(max(0, int(np.floor(low + 0.5))), min(shape_zyx[0], int(np.ceil(high + 0.5)))):
            share[z] += covered * max(0.0, min(high, z + 0.5) - max(low, z - 0.5))
    return share


def _inside(rings: Sequence[Floats], shape_yx: Sequence[int]) -> NDArray[np.bool_]:
    """Return which points of the pixels lie inside rings of points (x, y), by the even-odd rule."""
    height, width = (n * _POINTS for n in shape_yx)
    crossed = np.zeros((height, width + 1), np.int32)
    for ring in rings:
        # Points of pixels have whole numbers from here on.
        corners = (ring + 0.5) * _POINTS - 0.5
        for (x0, y0), (x1, y1) in pairwise([*corners, corners[0]]):
            low, high = (int(np.clip(np.ceil(y), 0, height)) for y in sorted((y0, y1)))
            if low < high:
                rows = np.arange(low, high)
                columns = np.ceil(x0 + (rows - y0) / (y1 - y0) * (x1 - x0)).astype(np.intp)
                np.add.at(crossed, (rows, np.clip(columns, 0, width)), 1)
    odd: NDArray[np.bool_] = np.cumsum(crossed, axis=1)[:, :-1] % 2 == 1
    return odd
