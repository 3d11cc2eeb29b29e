"""Rays that begin at proxy geometry, as in Díaz-García et al. 2018, section 3.

Two passes over the mesh: the first writes depth alone, the second runs the ray caster on the nearest faces. Where a ray
meets them is interpolated by the rasteriser in highp: positions in a texture of 8 bits, as some do it, are half a voxel
off from 128 voxels on, and OpenGL ES 2.0 draws into no others. Rays end where they leave the box.
"""

from dataclasses import dataclass

from volprep.shading.compose import Dialect, compose, literal
from volprep_formats.package.program import Uniform


@dataclass(frozen=True)
class Entry:
    """What a ray caster needs in order to begin at a mesh."""

    extent_mm_xyz: tuple[float, float, float]
    """True size of the volume."""
    spacing_mm: float
    """Smallest spacing of level 0."""

    @property
    def constants(self) -> dict[str, str]:
        """Words that its parts of the fragment shader use."""
        return {"ENTRY_MARGIN_MM": literal(self.spacing_mm / 2)}

    @property
    def uniforms(self) -> tuple[Uniform, ...]:
        """Uniforms that its vertex shader declares beside those of every ray caster."""
        return (
            Uniform(name="u_clip_from_box", type="mat4", source="clip_from_box"),
            Uniform(name="u_box_from_mesh", type="vec3", source="box_from_mesh"),
        )

    def vertex(self, dialect: Dialect) -> str:
        """Text of the vertex shader."""
        return compose("vertex_proxy", dialect, {}, {"BOX_MM": literal(*self.extent_mm_xyz)})

    def parts(self, dialect: Dialect, *, skips: bool, segments: bool) -> dict[str, str | None]:
        """Files of the slots of fragment.glsl."""
        parts: dict[str, str | None] = {
            "ray_ends": "proxy_entry",
            "ray_of_pixel": "proxy_ray",
            "entry_start": "proxy_start",
        }
        if segments:
            parts["first"] = "first_segment_entered"
        if dialect == "es100" and not skips:
            parts["loop"] = "loop_es100_entered"
        return parts


def depth_shader(dialect: Dialect) -> str:
    """Text of the fragment shader of the first pass."""
    return compose("proxy_depth", dialect, {"dialect": f"dialect_{dialect}"}, {})
