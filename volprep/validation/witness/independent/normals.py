"""Normals of voxels, and lighting of colours, in NumPy."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep.validation.witness.independent.scan import CannotWitnessError, Floats, WitnessedScan, between_eight

MOST_VOXELS = 2**25
"""Normals of more voxels would take 400 MB and more."""
SOFT_LENGTH = 0.01
"""Length of the normal of a place that counts half as a surface."""
SOFT_SLOPE = 4e-3
"""Slope of a place that counts half as a surface, in parts of the window over the smallest spacing."""
_ACROSS = {"thesis": ((6, 3), (3, 1)), "sobel": ((4, 2), (2, 1)), "isotropic": ((16, 4), (4, 1))}
"""Weights of the 3×3 voxels across a difference: middle and edge, edge and corner."""


@dataclass(frozen=True)
class WitnessedLight:
    """The light, and the normals that it falls on."""

    normals: NDArray[np.float32]
    """[z, y, x, (x, y, z)] of a scan's voxels, along its index axes."""
    place_mm: Floats | None
    """None: from where the viewer is."""
    ambient: float = 0.2
    diffuse: float = 0.7
    specular: float = 0.3
    shininess: float = 20.0
    halfway: bool = False
    soft: float = SOFT_LENGTH
    """Length of the normal of a place that counts half as a surface."""
    nearest: bool = False
    """Whether light is constant in each voxel, as labels are."""


def normals(scan: WitnessedScan, kernel: str) -> NDArray[np.float32]:
    """Return unit vectors along the gradient of each voxel, [z, y, x, (x, y, z)]; 0 where it has none."""
    if scan.stored.size > MOST_VOXELS:
        raise CannotWitnessError(f"normals of {scan.stored.size} voxels: {MOST_VOXELS} at most")
    stored = np.asarray(scan.stored, dtype=np.float32)
    spacing = np.linalg.norm(scan.world_from_index[:3, :3], axis=0)
    vectors = np.stack([_difference(stored, 2 - axis, kernel) / spacing[axis] for axis in range(3)], axis=-1)
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    unit: NDArray[np.float32] = np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)
    return unit


def slopes(scan: WitnessedScan, kernel: str, window: tuple[float, float]) -> NDArray[np.float32]:
    """Return differences of voxels one apart, in parts of a window per millimetre, [z, y, x, (x, y, z)].

    "central": of both neighbours. "forward": from a voxel to the next. Beyond the edge values stay as they are.
    """
    if scan.stored.size > MOST_VOXELS:
        raise CannotWitnessError(f"slopes of {scan.stored.size} voxels: {MOST_VOXELS} at most")
    padded = np.pad(np.clip(scan.physical(scan.stored), *window), 1, mode="edge")
    spacing = np.linalg.norm(scan.world_from_index[:3, :3], axis=0)
    inner = (slice(1, -1),) * 3
    found = np.empty((*scan.stored.shape, 3), np.float32)
    for axis in range(3):
        ahead = np.roll(padded, -1, 2 - axis)
        behind, apart = (np.roll(padded, 1, 2 - axis), 2.0) if kernel == "central" else (padded, 1.0)
        found[..., axis] = (ahead - behind)[inner] / (apart * spacing[axis] * (window[1] - window[0]))
    return found


def _difference(stored: NDArray[np.float32], axis: int, kernel: str) -> NDArray[np.float32]:
    """Return differences along an axis, smoothed across.

    Beyond the border values go on as straight lines along the axis, so that differences there have one side and are as
    long as others. Across the axis they stay as they are.
    """
    border = [(int(dimension == axis),) * 2 for dimension in range(3)]
    across = [(int(dimension != axis),) * 2 for dimension in range(3)]
    padded = np.pad(np.pad(stored, across, mode="edge"), border, mode="reflect", reflect_type="odd")

    def part(offsets: dict[int, int]) -> NDArray[Any]:
        return padded[
            tuple(slice(1 + offsets.get(axis, 0), padded.shape[axis] - 1 + offsets.get(axis, 0)) for axis in range(3))
        ]

    if kernel in {"forward", "central"}:
        return np.asarray(part({axis: 1}) - part({axis: 0 if kernel == "forward" else -1}))
    (middle, edge), (_, corner) = _ACROSS[kernel]
    one, other = (dimension for dimension in range(3) if dimension != axis)
    total = np.zeros(stored.shape, np.float32)
    for i in (-1, 0, 1):
        for j in (-1, 0, 1):
            weight = (middle, edge, corner)[abs(i) + abs(j)]
            total += weight * (part({axis: 1, one: i, other: j}) - part({axis: -1, one: i, other: j}))
    return total


def lit_colours(
    colours: Floats, light: WitnessedLight, scan: WitnessedScan, world_mm: Floats, directions: Floats
) -> Floats:
    """Return colours [ray, sample, 3] as light falls on both sides of a surface; without a normal they stay."""
    axes = scan.world_from_index[:3, :3] / np.linalg.norm(scan.world_from_index[:3, :3], axis=0)
    place = np.clip(scan.index_of(world_mm), 0.0, scan.counts_xyz - 1)
    normal = between_eight(light.normals, np.rint(place) if light.nearest else place) @ np.linalg.inv(axes)
    squared = (normal**2).sum(axis=-1, keepdims=True)
    along = directions[:, None]
    facing = (normal * along).sum(axis=-1, keepdims=True)
    if light.place_mm is None:
        return np.asarray(colours * np.sqrt((facing**2 + light.soft**2) / (squared + light.soft**2)))
    normal *= np.where(facing > 0.0, -1.0, 1.0) / np.sqrt(np.where(squared > 0.0, squared, 1.0))
    lit = _placed(colours, light, normal, light.place_mm - world_mm, along)
    return np.asarray(colours + (lit - colours) * (squared / (squared + light.soft**2)))


def _placed(colours: Floats, light: WitnessedLight, normal: Floats, to_light: Floats, along: Floats) -> Floats:
    """Return colours under a light with a place, after Phong or Blinn; normals face the viewer."""
    to_light = to_light / np.linalg.norm(to_light, axis=-1, keepdims=True)
    facing = (normal * to_light).sum(axis=-1, keepdims=True)
    if light.halfway:
        between = to_light - along
        shine = (normal * between).sum(axis=-1, keepdims=True) / np.linalg.norm(between, axis=-1, keepdims=True)
    else:
        mirrored = 2.0 * facing * normal - to_light
        shine = -(mirrored * along).sum(axis=-1, keepdims=True)
    highlight = np.where(facing > 0.0, light.specular * np.maximum(shine, 0.0) ** light.shininess, 0.0)
    lit: Floats = np.minimum(colours * (light.ambient + light.diffuse * np.maximum(facing, 0.0)) + highlight, 1.0)
    return lit
