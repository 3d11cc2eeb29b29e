"""Ray casting through bricks, OpenGL ES 3.0: a texture says where in another one each brick lies.

The layout is constant in the shader. Empty bricks cost a fetch from the first texture only.
"""

from volprep.shading.compose import Instance, literal
from volprep.shading.feature import Feature
from volprep.shading.positions import in_voxels, voxel_positions
from volprep_formats.grid import Grid
from volprep_formats.package.parts.bricks.record import BrickLayout
from volprep_formats.package.program import Sampler


def sampling(layout: BrickLayout, grid: Grid, *, gradients: bool) -> Feature:
    """Return how a level with these voxels is read; for `gradients` a voxel beyond a brick, too: its ghost voxels."""
    words = {
        "LAST_VOXEL": literal(*(n - 1 for n in grid.shape_zyx[::-1])),
        "CELLS": literal(*(max(n, 1) for n in layout.cells_zyx[::-1])),
        "LAST_BRICK": literal(*(n - 1 for n in layout.bricks_zyx[::-1])),
        "PITCH": literal(*layout.pitch_zyx[::-1]),
        "FIRST_TEXEL": literal(layout.reach - 0.5),
        "POOL": literal(*layout.texture_zyx[::-1]),
    }
    return Feature(
        slots={
            "sampling": (voxel_positions(grid.spacing_mm_zyx), Instance("sampling/bricks", words)),
            "value_near": "sampling/bricks:near" if gradients else None,
        },
        samplers=(Sampler(name="u_volume", role="volume"), Sampler(name="u_bricks", role="bricks")),
        offers=in_voxels(grid.shape_zyx) | ({"NEAR": "value_near", "OF": "centre, "} if gradients else {}),
    )
