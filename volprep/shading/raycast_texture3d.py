"""Ray casting through a 3D texture, OpenGL ES 3.0. One program draws every level: the level's scale is a uniform.

Where levels are mipmaps of one texture they have one scale, and the level is the uniform.
"""

from volprep.shading.raycast import Sampling
from volprep_formats.package.program import Sampler, Uniform


def sampling(component: str | None = "r", *, mipmaps: bool = False) -> Sampling:
    """How the volume is read: a value in a component of the texels; all of them, of colours or channels, if None."""
    return Sampling(
        dialect="es300",
        parts={
            "sampling": f"sample_texture3d{'_rgba' if component is None else ''}",
            "place": "place_texture3d",
            "mipmap": "mipmap" if mipmaps else None,
        },
        constants={**lod(mipmaps=mipmaps), **({} if component is None else {"OF": "", "COMPONENT": component})},
        uniforms=place_uniforms(mipmaps=mipmaps),
        samplers=(Sampler(name="u_volume", role="volume"),),
    )


def lod(*, mipmaps: bool) -> dict[str, str]:
    """Return the word for the mipmap that is read: a uniform where there are several."""
    return {"LOD": "u_mipmap" if mipmaps else "0.0"}


def place_uniforms(*, mipmaps: bool) -> tuple[Uniform, ...]:
    """Return the uniforms that say where in a 3D texture, or in which of its mipmaps, a position is read."""
    place = Uniform(name="u_texture_from_box", type="vec3", source="texture_from_box")
    return (place, Uniform(name="u_mipmap", type="float", source="mipmap")) if mipmaps else (place,)
