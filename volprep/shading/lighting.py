"""Diffuse light from where the viewer is (Lambert 1760), with normals that the package holds.

What has no normal, because the gradient is zero or codes around it cancel, keeps its own colour: it is no surface.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from volprep.shading.compose import literal
from volprep_formats.package.program import Sampler
from volprep_formats.package.texture import MosaicLayout, Texture

# Linear filtering of 8-bit codes leaves about a thousandth of a zero vector.
_LEAST_LENGTH = 0.01


@dataclass(frozen=True)
class Lighting:
    """What lighting adds to a ray caster."""

    parts: Mapping[str, str | None]
    """Files of its slots."""
    constants: Mapping[str, str]
    """Words that these files use."""
    samplers: tuple[Sampler, ...]
    """The samplers that they declare."""


def headlight(texture: Texture) -> Lighting:
    """Light from the viewer, on normals of this kind: the same for every level that the program draws.

    A mosaic, of which this is any texture, has the slices of the volume's level, and its constants name them.
    """
    if texture.normals is None:
        msg = f"texture {texture.name} holds no normals"
        raise ValueError(msg)
    code = texture.normals.code
    parts: dict[str, str | None] = {
        "lighting": "normals_texture3d",
        "normal_code": f"normal_{code}",
        "octahedron": "octahedron",
        "light_start": "headlight_start",
        "light": "headlight",
    }
    constants = {"LEAST_SQUARED": literal(_LEAST_LENGTH**2)}
    if code == "oct8":
        # Luminance comes as red, green and blue.
        constants["NUMBERS"] = "ra" if texture.gl.format == "LUMINANCE_ALPHA" else "rg"
    samplers: tuple[Sampler, ...] = (Sampler(name="u_normals", role="normals"),)
    if texture.mosaic is not None:
        fetch = _mosaic_fetch(texture.mosaic, texture.filter)
        parts.update(fetch.parts)
        constants.update(fetch.constants)
        samplers = fetch.samplers
    return Lighting(parts, constants, samplers)


def _mosaic_fetch(layout: MosaicLayout, between: Literal["linear", "nearest"]) -> Lighting:
    """What reads normals from a mosaic instead of a 3D texture, and is the same between slices as within them."""
    height, width = layout.tile_shape_yx
    rows, columns = layout.texture_shape_yx
    slices = "slice" if layout.slices == 1 else between
    parts: dict[str, str | None] = {
        "lighting": "normals_mosaic",
        "normal_slices": f"normals_mosaic_{slices}",
        "normal_units": "normals_mosaic_one_unit",
        "normal_unit": None,
        "normal_fetch": "normals_mosaic_fetch",
    }
    constants = {
        "NORMAL_TILE": literal(width, height),
        "NORMAL_MOSAIC": literal(columns, rows),
        "NORMAL_TILES_X": literal(layout.tiles_x),
    }
    names = ["u_normals"]
    if layout.textures > 1:
        parts |= {"normal_units": "normals_mosaic_units", "normal_unit": "normals_mosaic_unit"}
        parts["normal_fetch"] = "normals_mosaic_fetch_unit"
        constants["NORMAL_TILES"] = literal(layout.tiles_x * layout.tiles_y)
        constants["NORMAL_UNIT"] = " ".join(str(part) for part in range(layout.textures - 1))
        constants["LAST_NORMAL_UNIT"] = str(layout.textures - 1)
        names = [f"u_normals_{part}" for part in range(layout.textures)]
    samplers = tuple(Sampler(name=name, role="normals", part=part) for part, name in enumerate(names))
    return Lighting(parts, constants, samplers)
