"""Positions in voxels, for volumes that are read voxel by voxel: mosaics, bricks and sub-volumes."""

from volprep.shading.compose import Instance, literal


def in_voxels(shape_zyx: tuple[int, int, int]) -> dict[str, str]:
    """Return what features of sampling offer whose positions are in voxels of a level of this shape."""
    return {
        "POSITION_PER_MM": "VOXELS_PER_MM",
        "VOXEL": "vec3(1.0)",
        "LAST_POSITION": literal(*(float(n) for n in shape_zyx[::-1])),
    }


def voxel_positions(spacing_mm_zyx: tuple[float, float, float]) -> Instance:
    """Return the part that makes positions in voxels of this spacing from box millimetres."""
    per_mm = literal(*(1 / spacing for spacing in spacing_mm_zyx[::-1]))
    return Instance("sampling/voxel_positions", {"VOXELS_PER_MM": per_mm})
