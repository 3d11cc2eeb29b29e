"""Compare voxels, transfer functions and cameras of product and truth with an independent reading."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep.truth.volume import Volume
from volprep.validation.subjects.subject import Subject
from volprep.validation.witness.check import WitnessCheck
from volprep.validation.witness.independent.camera import Box, rays
from volprep.validation.witness.independent.package import Json, corner_and_size, world_from_index
from volprep.validation.witness.independent.scan import CannotWitnessError, Floats, WitnessedScan
from volprep.validation.witness.independent.scene import WitnessedFunction

NUMPY = f"NumPy {np.__version__}"
_PLACE_VOXELS = 1e-3
"""Affine matrices of NIfTI have 24 bits."""
_VALUE_SHARE = 1e-5
"""Part of the range: readers may round doubles to single precision."""
_MOST_COMPARED = 2**28
"""Voxels that are compared; of a larger scan, so many in its middle slices."""
_AT_ONCE = 2**22
"""Voxels that are in memory in double precision."""


def check_voxels(name: str, scan: Volume, grid: Json, other: WitnessedScan) -> Iterator[WitnessCheck]:
    """Compare places and physical values of all voxels; `grid` is the record of the scan's grid."""
    between = np.linalg.inv(other.world_from_index) @ world_from_index(grid)
    order = np.abs(between[:3, :3]).argmax(axis=0)
    snapped = np.rint(between)
    last = np.array(grid["shape_zyx"][::-1]) - 1
    corners = np.array(list(np.ndindex(2, 2, 2))) * last
    off = (corners @ (between - snapped)[:3, :3].T + (between - snapped)[:3, 3]).ravel()
    counts = tuple(int(n) for n in other.counts_xyz[order])
    same_shape = counts == tuple(grid["shape_zyx"][::-1]) and sorted(order) == [0, 1, 2]
    yield WitnessCheck(
        item=f"grid of {name}",
        by=other.library,
        what="largest distance of a corner from its voxel, in voxels" if same_shape else f"a grid of {counts} voxels",
        found=float(np.abs(off).max()) if same_shape else float("1e9"),
        limit=_PLACE_VOXELS,
    )
    if not same_shape:
        return
    turned = other.stored.transpose(*(2 - order[::-1]))
    for axis in range(3):
        if snapped[order[axis], axis] < 0:
            turned = np.flip(turned, 2 - axis)
    yield _check_values(name, scan, other, turned)


def _check_values(name: str, scan: Volume, other: WitnessedScan, turned: NDArray[Any]) -> WitnessCheck:
    """Compare physical values; `turned` holds the other reading along our axes."""
    depth, per_slice = scan.stored.shape[0], int(np.prod(scan.stored.shape[1:]))
    slices = max(1, min(depth, _MOST_COMPARED // per_slice))
    first = (depth - slices) // 2
    largest, low, high = 0.0, np.inf, -np.inf
    thin = max(1, _AT_ONCE // per_slice)
    for begin in range(first, first + slices, thin):
        chosen = slice(begin, min(begin + thin, first + slices))
        theirs = other.physical(turned[chosen])
        ours = scan.slope * scan.stored[chosen].astype(np.float64) + scan.intercept
        largest = max(largest, float(np.abs(ours - theirs).max()))
        low, high = min(low, float(theirs.min())), max(high, float(theirs.max()))
    share = "" if slices == depth else f" of {slices} of {depth} slices"
    return WitnessCheck(
        item=f"voxels of {name}",
        by=other.library,
        what=f"largest difference of a physical value{share}",
        found=largest,
        limit=_VALUE_SHARE * (high - low) + 1e-6 * max(abs(low), abs(high)),
    )


def check_function(subject: Subject, wanted: WitnessedFunction, diagonal_mm: float) -> Iterator[WitnessCheck]:
    """Compare control points of a transfer function."""
    name = wanted.name
    function = subject.function(name)
    extinctions, length_mm = wanted.for_diagonal(diagonal_mm)
    points = function.points
    if len(points) != len(wanted.colours):
        raise CannotWitnessError(f"{name} has {len(points)} points, not {len(wanted.colours)}")
    scale = max(float(extinctions.max()), 1e-300)
    found = {
        "colour": np.array([point.colour for point in points]) - wanted.colours,
        "extinction, as part of the largest": (np.array([p.extinction_per_mm for p in points]) - extinctions) / scale,
        "reference length, as part of it": np.array([function.reference_mm / length_mm - 1.0]),
    }
    if wanted.values is not None:
        values = np.array([point.value for point in points])
        found["value, as part of the largest"] = (values - wanted.values) / max(np.abs(wanted.values).max(), 1e-300)
    worst = max(found, key=lambda name: float(np.abs(found[name]).max()))
    yield WitnessCheck(
        item=f"transfer function {name}",
        by=NUMPY,
        what=f"largest difference of a {worst}",
        found=float(np.abs(found[worst]).max()),
        limit=1e-6,
    )


def box_of(grid: Json, projection: str) -> Box:
    """Return the box that fills the standard views of a grid record."""
    corner, size = corner_and_size(grid)
    direction = np.array(grid["direction"], dtype=np.float64)
    return Box(corner + direction @ (size / 2.0), float(np.linalg.norm(size)), projection)


def check_cameras(subject: Subject, grid: Json, projection: str) -> Iterator[WitnessCheck]:
    """Compare rays of corner pixels of all views with an independent camera; `grid` is the record of level 0."""
    box, pixels = box_of(grid, projection), subject.shape_hw[0]
    corner, _ = corner_and_size(grid)
    direction = np.array(grid["direction"], dtype=np.float64)
    rows, columns = (np.array(value, dtype=np.float64) for value in ((0, 1, pixels - 1), (2, pixels - 1, 0)))
    worst = 0.0
    for name, box_from_clip in subject.views.items():
        origins, directions = rays(name, box, pixels, rows, columns)
        across, above = 2.0 * (columns + 0.5) / pixels - 1.0, 1.0 - 2.0 * (rows + 0.5) / pixels
        ends = []
        for depth in (-1.0, 1.0):
            clip = np.stack([across, above, np.full_like(across, depth), np.ones_like(across)], axis=-1)
            homogeneous = clip @ box_from_clip.T
            ends.append(corner + homogeneous[:, :3] / homogeneous[:, 3:] @ direction.T)
        worst = max(worst, _apart(ends[0], ends[1], origins, directions) / box.diagonal_mm)
    yield WitnessCheck(
        item="cameras",
        by=NUMPY,
        what="largest distance of two rays of one pixel, as part of the diagonal",
        found=worst,
        limit=1e-6,
    )


def _apart(near: Floats, far: Floats, origins: Floats, directions: Floats) -> float:
    """Return how far rays from `near` to `far` leave those from `origins`, and how far they go back."""
    largest = 0.0
    for point in (near, far):
        along = ((point - origins) * directions).sum(axis=1, keepdims=True)
        largest = max(largest, float(np.linalg.norm(point - origins - along * directions, axis=1).max()))
    turned = ((far - near) * directions).sum(axis=1)
    return largest if turned.min() > 0.0 else float(np.abs(far - near).max())
