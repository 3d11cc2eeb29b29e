"""Diffuse light from where the viewer is (Lambert 1760), with normals that the package holds.

What has no normal, because the gradient is zero or codes around it cancel, keeps its own colour: it is no surface.
"""

from volprep.shading.compose import Instance, Slot, literal
from volprep.shading.feature import Feature
from volprep.shading.mosaic import Mosaic
from volprep_formats.package.program import Sampler
from volprep_formats.package.texture import Texture

# Linear filtering of 8-bit codes leaves about a thousandth of a zero vector.
_LEAST_LENGTH = 0.01


def headlight(texture: Texture) -> Feature:
    """Return light from the viewer, on normals of this kind: the same for every level that the program draws.

    Of a mosaic in several textures, `texture` is any.
    """
    normals = normals_of(texture)
    return Feature(
        slots={**normals.slots, "lighting_start": "light/headlight:start", "light": "light/headlight:sample"},
        words={**normals.words, "LEAST_SQUARED": literal(_LEAST_LENGTH**2)},
        samplers=normals.samplers,
    )


def normals_of(texture: Texture) -> Feature:
    """Return what gives the normal at a position."""
    if texture.normals is None:
        msg = f"texture {texture.name} holds no normals"
        raise ValueError(msg)
    code = texture.normals.code
    slots: dict[str, Slot] = {
        "lighting": "light/normals",
        "normal_code": f"light/{code}",
        "normal_texels": "light/normals:texture3d",
        "octahedron": "light/octahedron",
    }
    words = {"NORMAL_TEXEL": "textureLod(u_normals, at, 0.0)"}
    samplers: tuple[Sampler, ...] = (Sampler(name="u_normals", role="normals"),)
    if code == "oct8":
        # Luminance comes as red, green and blue.
        words["NUMBERS"] = "ra" if texture.gl.format == "LUMINANCE_ALPHA" else "rg"
    if texture.mosaic is not None:
        mosaic = Mosaic(
            "They are a mosaic, in tiles of one slice each.",
            texture.mosaic,
            sampler="u_normals",
            role="normals",
            texel="normal_tile_texel",
            prefix="NORMAL_",
        )
        voxels: Instance = mosaic.voxels("normal_texel", texture.filter)
        slots["normal_texels"] = (mosaic.texels, voxels)
        words["NORMAL_TEXEL"] = "normal_texel(at)"
        samplers = mosaic.samplers
    return Feature(slots, words, samplers=samplers)
