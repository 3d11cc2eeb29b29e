"""Ray casting through a mosaic, OpenGL ES 2.0. The layout is constant in the shader, which draws one level.

The fetch is derived here, not taken from print: the published listing (Congote et al., repeated in the mobile volume
rendering thesis) finds the row with the number of rows instead of columns, reads a slice beyond the last, is half a
slice off in z, and lets the filter reach into the next tile. Each layout has its own text: no channel is chosen where
there is one, no texture where there is one, and nothing is clamped where gutters hold what the filter reaches.
"""

from volprep.shading.compose import literal
from volprep.shading.raycast import Sampling
from volprep_formats.package.program import Sampler
from volprep_formats.package.texture import MosaicLayout, SampleFilter
from volprep_formats.textures.mosaic import tiles_of


def sampling(
    layout: MosaicLayout,
    spacing_mm_zyx: tuple[float, float, float],
    component: str | None = "r",
    between: SampleFilter = "linear",
) -> Sampling:
    """How a level of this spacing is read, and what is between its voxels.

    Values are in a component of the texels where these hold one slice; if None, all components are read.
    """
    height, width = layout.tile_shape_yx
    rows, columns = layout.texture_shape_yx
    constants = {
        "VOXELS_PER_MM": literal(*(1 / spacing for spacing in spacing_mm_zyx[::-1])),
        "PITCH": literal(*layout.pitch_yx[::-1]),
        "MOSAIC": literal(columns, rows),
        "TILES_X": literal(layout.tiles_x),
    }
    parts: dict[str, str | None] = {
        "tile": "mosaic_tile",
        "units": "mosaic_one_unit",
        "unit": None,
        "inside": "mosaic_clamp",
        "fetch": "mosaic_fetch",
        "planar_unit": None,
    }
    samplers = tuple(Sampler(name=_name(layout, part), role="volume", part=part) for part in range(layout.textures))
    if layout.textures > 1:
        parts |= {"units": "mosaic_units", "unit": "mosaic_unit", "fetch": "mosaic_fetch_unit"}
        parts["planar_unit"] = "mosaic_planar_unit"
        constants["UNIT"] = " ".join(str(part) for part in range(layout.textures - 1))
        constants["LAST_UNIT"] = str(layout.textures - 1)
    if layout.gutter:
        parts["inside"] = "mosaic_gutter"
        constants["GUTTER"] = literal(layout.gutter)
    elif any(layout.padding_yx):
        parts["inside"] = "mosaic_clamp_padded"
        constants["LAST_PLACE"] = literal(width - 0.5, height - 0.5)
    if layout.textures > 1 or _part(layout) == "planar":
        constants["TILES"] = literal(layout.tiles_x * layout.tiles_y)
    if layout.slices > 1:
        constants["LAST_SLICE"] = literal(layout.slices - 1)
    if _part(layout) == "overlapping":
        constants["LAST_TILE"] = literal(tiles_of(layout.slices, layout.channels, "overlapping") - 1)
    parts["sampling"] = f"sample_mosaic_{_part(layout)}"
    if between == "nearest" and layout.slices > 1:
        parts["sampling"] = f"sample_mosaic_nearest_{layout.channels}"
        parts["nearest_channel"] = f"nearest_channel_{layout.order}"
    elif _part(layout) in {"slice", "1"}:
        parts["stored_value"] = None if component is None else "stored_value"
        constants |= {} if component is None else {"COMPONENT": component}
    return Sampling(dialect="es100", parts=parts, constants=constants, uniforms=(), samplers=samplers)


def _part(layout: MosaicLayout) -> str:
    if layout.slices == 1:
        return "slice"
    return "1" if layout.channels == 1 else layout.order


def _name(layout: MosaicLayout, part: int) -> str:
    return "u_volume" if layout.textures == 1 else f"u_volume_{part}"
