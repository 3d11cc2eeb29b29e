"""Ray casting through a mosaic, OpenGL ES 2.0. The layout is constant in the shader, which draws one level.

The fetch is derived here, not taken from print: the published listing (Congote et al., repeated in the mobile volume
rendering thesis) finds the row with the number of rows instead of columns, reads a slice beyond the last, is half a
slice off in z, and lets the filter reach into the next tile.
"""

from volprep.mosaic import mosaic_shape_yx
from volprep.render.compose import literal
from volprep.render.techniques.raycast import Sampling
from volprep_formats.package.manifest import MosaicLayout


def sampling(layout: MosaicLayout, spacing_mm_zyx: tuple[float, float, float]) -> Sampling:
    """How a level of this spacing is read."""
    height, width = layout.tile_shape_yx
    rows, columns = mosaic_shape_yx(layout)
    constants = {
        "VOXELS_PER_MM": literal(*(1 / spacing for spacing in spacing_mm_zyx[::-1])),
        "TILE": literal(width, height),
        "MOSAIC": literal(columns, rows),
        "TILES_X": literal(layout.tiles_x),
    }
    part = "sample_mosaic_slice"
    if layout.slices > 1:
        part = f"sample_mosaic_{layout.channels}"
        constants["LAST_SLICE"] = literal(layout.slices - 1)
    return Sampling(dialect="es100", parts={"sampling": part, "tile": "mosaic_tile"}, constants=constants, uniforms=())
