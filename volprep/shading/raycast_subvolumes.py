"""Ray casting through the eight sub-volumes around a point of the grid, OpenGL ES 3.0.

In the Beaver Volume Renderer (Schultz and Bailey, 7.3.3) the eight pieces share no voxels, and each is stretched over
half of the texture coordinates, so that the outer half voxels of neighbours clamp against each other: a seam. Here a
position lies between voxels that one piece holds.
"""

from volprep.shading.compose import Instance
from volprep.shading.feature import Feature
from volprep.shading.positions import in_voxels, voxel_positions
from volprep_formats.grid import Grid
from volprep_formats.package.program import Sampler, Uniform, UniformSource

PIECES = 8
_VECTORS: dict[str, UniformSource] = {
    "u_split": "split_voxel",
    "u_low_start": "low_start_voxel",
    "u_low_size": "low_size_voxels",
    "u_high_start": "high_start_voxel",
    "u_high_size": "high_size_voxels",
    "u_box_low_mm": "block_low_mm",
    "u_box_high_mm": "block_high_mm",
}


def sampling(grid: Grid, *, gradients: bool) -> Feature:
    """Return how level 0 of this grid is read, for `gradients` also how steep it is; outside nothing is drawn."""
    return Feature(
        slots={
            "sampling": (voxel_positions(grid.spacing_mm_zyx), Instance("sampling/subvolumes")),
            "slopes": "sampling/subvolumes:slopes" if gradients else None,
        },
        words={"LOW_CORNER_MM": "u_box_low_mm", "HIGH_CORNER_MM": "u_box_high_mm"},
        uniforms=tuple(Uniform(name=name, type="vec3", source=source) for name, source in _VECTORS.items()),
        samplers=tuple(Sampler(name=f"u_subvolume_{part}", role="subvolume", part=part) for part in range(PIECES)),
        offers=in_voxels(grid.shape_zyx),
    )
