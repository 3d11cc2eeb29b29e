"""Ray casting through bricks, OpenGL ES 3.0: a texture says where in another one each brick lies.

The layout is constant in the shader. Empty bricks cost a fetch from the first texture only.
"""

from volprep.shading.compose import literal
from volprep.shading.raycast import Sampling
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.parts.bricks.record import BrickLayout
from volprep_formats.package.program import Sampler


def sampling(
    layout: BrickLayout, shape_zyx: tuple[int, int, int], spacing_mm_zyx: tuple[float, float, float]
) -> Sampling:
    """How a level of this shape and spacing is read."""
    return Sampling(
        dialect="es300",
        parts={"sampling": "sample_bricks"},
        constants={
            "VOXELS_PER_MM": literal(*(1 / spacing for spacing in spacing_mm_zyx[::-1])),
            "LAST_VOXEL": literal(*(n - 1 for n in shape_zyx[::-1])),
            "CELLS": literal(*(max(n, 1) for n in layout.cells_zyx[::-1])),
            "LAST_BRICK": literal(*(n - 1 for n in layout.bricks_zyx[::-1])),
            "PITCH": literal(*layout.pitch_zyx[::-1]),
            "FIRST_TEXEL": literal(layout.reach - 0.5),
            "POOL": literal(*layout.texture_zyx[::-1]),
        },
        uniforms=(),
        samplers=(Sampler(name="u_volume", role="volume"), Sampler(name="u_bricks", role="bricks")),
    )


def sampling_of(manifest: Manifest, level: int) -> Sampling:
    """How a level of a package is read."""
    found = next(each for each in manifest.levels if each.index == level)
    pool = next(each for each in manifest.textures if each.bricks is not None and each.level == level)
    assert pool.bricks is not None  # noqa: S101 - as above
    return sampling(pool.bricks, found.grid.shape_zyx, found.grid.spacing_mm_zyx)
