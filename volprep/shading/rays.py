"""How the rays of a program begin: at the volume's box, or at proxy geometry (Díaz-García et al. 2018, section 3).

At proxy geometry there are two passes over the mesh: the first writes depth alone, the second runs the ray caster on
the nearest faces. Where a ray meets them is interpolated by the rasteriser in highp: positions in a texture of 8 bits,
as some do it, are half a voxel off from 128 voxels on, and OpenGL ES 2.0 draws into no others. Rays end where they
leave the box.
"""

from volprep.shading.compose import Dialect, Slot, compose, literal
from volprep.shading.feature import Feature
from volprep_formats.grid import Grid
from volprep_formats.package.program import Rays, Uniform


def ray_feature(rays: Rays, grid: Grid, *, backwards: bool = False) -> Feature:
    """Return how rays begin. It offers the first sample, and where the segment of that sample begins.

    `backwards` exchanges their ends. Raises ValueError for that at a mesh, where rays begin and do not end.
    """
    if rays == "mesh" and backwards:
        msg = "a ray from its far end does not begin at proxy geometry"
        raise ValueError(msg)
    if rays == "box":
        first, last = ("v_far", "v_near") if backwards else ("v_near", "v_far")
        return Feature(
            slots={
                "rays": "ray/from_box",
                "rays_ends": "ray/from_box:backwards" if backwards else None,
                "rays_start": None,
            },
            words={"NEAR_END": first, "FAR_END": last},
            offers={"FIRST": "0.5", "FIRST_CELL": "cell_start", "FIRST_FRONT": "start"}
            | ({"FROM_VIEWER": "-ray"} if backwards else {}),
        )
    return Feature(
        slots={"rays": "ray/from_mesh", "rays_ends": "ray/from_mesh:ends", "rays_start": "ray/from_mesh:start"},
        words={
            "NEAR_END": "near_end",
            "FAR_END": "far_end",
            "ENTRY_MARGIN_MM": literal(min(grid.spacing_mm_zyx) / 2),
        },
        offers={
            "FIRST": "entered",
            "FIRST_CELL": "cell_start + cell_stride * (entered - 0.5)",
            "FIRST_FRONT": "start + stride * (entered - 0.5)",
        },
        uniforms=(
            Uniform(name="u_clip_from_box", type="mat4", source="clip_from_box"),
            Uniform(name="u_box_from_mesh", type="vec3", source="box_from_mesh"),
        ),
    )


def vertex_shader(rays: Rays, grid: Grid, dialect: Dialect) -> str:
    """Return the text of the vertex shader."""
    if rays == "box":
        return compose("vertex/picture", dialect, {}, {})
    return compose("vertex/mesh", dialect, {}, {"BOX_MM": literal(*grid.extent_mm_zyx[::-1])})


def depth_shader(dialect: Dialect) -> str:
    """Return the text of the fragment shader of the first pass over a mesh."""
    slots: dict[str, Slot] = {"dialect": f"ray/dialect_{dialect}"}
    return compose("ray/depth", dialect, slots, {})
