"""Ray casting through a 3D texture, OpenGL ES 3.0. One program draws every level: the level's scale is a uniform.

Where levels are mipmaps of one texture they have one scale, and the level is the uniform.
"""

from collections.abc import Sequence
from dataclasses import replace

from volprep.shading.compose import Instance, literal
from volprep.shading.feature import Feature
from volprep_formats.package.picture import OF_MEDIUM
from volprep_formats.package.program import Sampler, Uniform


def sampling(
    component: str | None = "r", *, mipmaps: bool = False, extent_mm_zyx: Sequence[float] | None = None
) -> Feature:
    """Return how the volume is read: a component of its texels; all of them, of colours or channels, if None.

    Mipmaps may have more texels than the volume, whose extent is known then, has voxels.
    """
    textures, samplers = [_texture("", component, mipmaps=mipmaps)], (Sampler(name="u_volume", role="volume"),)
    return _feature(textures, samplers, extent_mm_zyx if mipmaps else None)


def sampling_apart(
    transfers: Sequence[str], *, mipmaps: bool = False, extent_mm_zyx: Sequence[float] | None = None
) -> Feature:
    """Return how several channels are read, of these transfer functions, that have a 3D texture each."""
    textures = [_texture(f"_{index}", "r", mipmaps=mipmaps) for index in range(len(transfers))]
    samplers = tuple(
        Sampler(name=f"u_volume_{index}", role="volume", transfer=transfer) for index, transfer in enumerate(transfers)
    )
    return _feature(textures, samplers, extent_mm_zyx if mipmaps else None)


def sampling_on_grids(transfers: Sequence[str], extents_mm_zyx: Sequence[Sequence[float]]) -> Feature:
    """Return how channels are read that lie on several grids: each at places of its own along the ray.

    `transfers` are their transfer functions, `extents_mm_zyx` the sizes of their boxes.
    """
    numbers = range(len(transfers))
    apart = sampling_apart(transfers)
    places = [
        Instance("sampling/grids:place", {"OF": f"_{number}", "EXTENT_MM": literal(*extent_mm_zyx[::-1])})
        for number, extent_mm_zyx in enumerate(extents_mm_zyx)
    ]
    begun = [Instance("sampling/grids:start", {"OF": f"_{number}"}) for number in numbers]
    textures = apart.slots["sampling"]
    assert isinstance(textures, tuple)  # noqa: S101 - a place, and one texture for each channel
    uniforms = [
        uniform
        for number in numbers
        for uniform in (
            Uniform(name=f"u_medium_{number}_from_box", type="mat4x4f", source=OF_MEDIUM[number][0]),
            Uniform(name=f"u_texture_from_medium_{number}", type="vec3f", source=OF_MEDIUM[number][1]),
            Uniform(name=f"u_opacity_{number}", type="f32", source=OF_MEDIUM[number][2]),
        )
    ]
    return replace(
        apart,
        slots={"sampling": (Instance("sampling/grids"), *places, *textures[1:]), "classification_start": tuple(begun)},
        uniforms=tuple(uniforms),
        offers={**apart.offers, "POSITION_PER_MM": "vec3(1.0)"},
    )


def _texture(suffix: str, component: str | None, *, mipmaps: bool) -> Instance:
    words = {
        "OF": suffix,
        "FUNCTION": "vec4 voxel_texel" if component is None else "float ${STORED}",
        "COMPONENT": "" if component is None else f".{component}",
        "LOD": "u_mipmap" if mipmaps else "0.0",
    }
    return Instance("sampling/texture3d", words)


def _feature(
    textures: Sequence[Instance], samplers: tuple[Sampler, ...], mipmaps_of_mm_zyx: Sequence[float] | None
) -> Feature:
    """Return the feature of textures that hold the mipmaps of a volume of this size, or one level if None."""
    mipmaps = mipmaps_of_mm_zyx is not None
    place = Uniform(name="u_texture_from_box", type="vec3f", source="texture_from_box")
    return Feature(
        slots={
            "sampling": (Instance("sampling/texture3d_place"), *textures),
            "mipmap": "sampling/texture3d_place:mipmap" if mipmaps else None,
        },
        uniforms=(place, Uniform(name="u_mipmap", type="f32", source="mipmap")) if mipmaps else (place,),
        samplers=samplers,
        offers={
            "POSITION_PER_MM": "u_texture_from_box",
            "VOXEL": f"{'exp2(u_mipmap)' if mipmaps else '1.0'} / vec3(textureSize(u_volume, 0))",
            "LAST_POSITION": f"position({literal(*mipmaps_of_mm_zyx[::-1])})" if mipmaps_of_mm_zyx else "1.0",
        },
    )
