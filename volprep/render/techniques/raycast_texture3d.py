"""Ray casting through a 3D texture, OpenGL ES 3.0. One program draws every level: the level's scale is a uniform.

Where levels are mipmaps of one texture they have one scale, and the level is the uniform.
"""

from volprep.render.techniques.raycast import Sampling
from volprep_formats.package.manifest import Sampler, Uniform


def sampling(*, classified: bool = False, component: str = "r", mipmaps: bool = False) -> Sampling:
    """How the volume is read: a value in a component of the texels, or all of voxels that are classified already."""
    return Sampling(
        dialect="es300",
        parts={
            "sampling": "sample_texture3d_rgba" if classified else "sample_texture3d",
            "mipmap": "mipmap" if mipmaps else None,
        },
        constants={"LOD": "u_mipmap" if mipmaps else "0.0", **({} if classified else {"COMPONENT": component})},
        uniforms=(
            Uniform(name="u_texture_from_box", type="vec3", source="texture_from_box"),
            *([Uniform(name="u_mipmap", type="float", source="mipmap")] if mipmaps else []),
        ),
        samplers=(Sampler(name="u_volume", role="volume"),),
    )
