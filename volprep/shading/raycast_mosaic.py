"""Ray casting through a mosaic, OpenGL ES 2.0. The layout is constant in the shader, which draws one level.

Each layout has its own text: no channel is chosen where there is one.
"""

from collections.abc import Mapping
from types import MappingProxyType

from volprep.shading.compose import Instance, Slot, literal
from volprep.shading.feature import Feature
from volprep.shading.mosaic import Mosaic
from volprep.shading.positions import in_voxels, voxel_positions
from volprep_formats.package.texture import MosaicLayout, SampleFilter
from volprep_formats.textures.mosaic import tiles_of


def sampling(
    layout: MosaicLayout,
    spacing_mm_zyx: tuple[float, float, float],
    component: str | None = "r",
    between: SampleFilter = "linear",
) -> Feature:
    """Return how a level of this spacing is read, and the interpolation between its voxels.

    Values are in a component of the texels where these hold one slice; if None, all components are read.
    """
    about = "The volume as a mosaic: normalised stored values, 0 to 1, in tiles of one slice and channel each."
    mosaic = Mosaic(about, layout, sampler="u_volume", role="volume", texel="tile_texel")
    positions = voxel_positions(spacing_mm_zyx)
    return Feature(
        slots={"sampling": (positions, mosaic.texels, *values_of(mosaic, component, between))},
        samplers=mosaic.samplers,
        offers=in_voxels((layout.slices, *layout.tile_shape_yx)),
    )


def values_of(
    mosaic: Mosaic, component: str | None, between: SampleFilter, named: Mapping[str, str] = MappingProxyType({})
) -> list[Instance]:
    """Return the parts that read the value at a position in voxels; `named` may name their function, STORED."""
    layout = mosaic.layout
    if layout.slices > 1 and layout.slices_per_texel > 1:
        return [_of_four(layout, between, named)]
    voxels = mosaic.voxels("voxel_texel", between)
    return (
        [voxels]
        if component is None
        else [voxels, Instance("sampling/stored_value", {"COMPONENT": component, **named})]
    )


def _of_four(layout: MosaicLayout, between: SampleFilter, named: Mapping[str, str]) -> Instance:
    """Return the feature that reads values with four to a texel."""
    words = {"LAST_SLICE": literal(layout.slices - 1), **named}
    slots: dict[str, Slot] = {}
    if layout.order == "overlapping":
        words["LAST_TILE"] = literal(tiles_of(layout.slices, layout.slices_per_texel, "overlapping") - 1)
    elif layout.order == "planar":
        words["TILES"] = literal(layout.tiles_x * layout.tiles_y)
        slots["planar_unit"] = "sampling/mosaic_planar:unit" if layout.textures > 1 else None
    if between == "linear":
        return Instance(f"sampling/mosaic_{layout.order}", words, slots)
    slots["nearest_channel"] = f"sampling/mosaic_nearest:{layout.order}"
    return Instance("sampling/mosaic_nearest", words, slots)
