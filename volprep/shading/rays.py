"""The ends of a program's rays: at the volume's box, or at proxy geometry (Díaz-García et al. 2018, section 3).

At proxy geometry a pass draws the mesh twice: its nearest faces, and its farthest ones. Each fragment gives the place
where the ray meets the face, in 16 bits, as a part of the ray inside the box: 1/40 of a voxel or less. One texture of
four bytes holds both, which every OpenGL ES 2.0 can draw into. Rays and samples are the same as for the box; the mesh
leaves out the samples in front of it and behind it, whatever the technique is.
"""

from volprep.shading.compose import Dialect, Instance, Slot, compose, literal
from volprep.shading.feature import Feature
from volprep.shading.walk import PassText
from volprep_formats.grid import Grid
from volprep_formats.package.program import Rays, Uniform

MESH = "u_mesh"
"""Sampler of the pass over proxy geometry."""


def ray_feature(rays: Rays, grid: Grid, *, backwards: bool = False) -> Feature:
    """Return how rays begin and end. It offers the first and the last sample, and where the first segment begins.

    `backwards` exchanges the ends of rays. Raises ValueError for that at a mesh.
    """
    if rays == "mesh":
        if backwards:
            msg = "a ray from its far end does not begin at proxy geometry"
            raise ValueError(msg)
        return _at_mesh(grid)
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


def _at_mesh(grid: Grid) -> Feature:
    return Feature(
        slots={
            "rays": (Instance("ray/from_box"), Instance("ray/from_mesh:place"), Instance("ray/from_mesh")),
            "rays_ends": None,
            "rays_start": "ray/from_mesh:start",
        },
        words={
            "NEAR_END": "v_near",
            "FAR_END": "v_far",
            "PLACE": "v_place",
            "MARGIN_MM": literal(min(grid.spacing_mm_zyx) / 2),
        },
        offers={
            "FIRST": "entered",
            "FIRST_CELL": "cell_start + cell_stride * (entered - 0.5)",
            "FIRST_FRONT": "start + stride * (entered - 0.5)",
            "LAST": "left",
        },
    )


def vertex_shader(rays: Rays, dialect: Dialect) -> str:
    """Return the text of the vertex shader."""
    part = "vertex/picture"
    slots: dict[str, Slot] = {"place_declared": None, "place": None}
    if rays == "mesh":
        slots = {name: f"{part}:{name}" for name in slots}
    return compose(part, dialect, slots, {})


def mesh_pass(grid: Grid, dialect: Dialect) -> PassText:
    """Return the pass that draws where rays meet a mesh."""
    box_mm = literal(*grid.extent_mm_zyx[::-1])
    slots: dict[str, Slot] = {"dialect": f"ray/dialect_{dialect}", "box": "ray/box", "inside": "ray/box:inside"}
    words = {"LOW_CORNER_MM": "vec3(0.0)", "HIGH_CORNER_MM": box_mm}
    return PassText(
        compose("passes/mesh", dialect, slots, words),
        "mesh",
        MESH,
        "rgba8",
        (
            Uniform(name="u_clip_from_box", type="mat4x4f", source="clip_from_box"),
            Uniform(name="u_box_from_mesh", type="vec3f", source="box_from_mesh"),
            Uniform(name="u_box_from_clip", type="mat4x4f", source="box_from_clip"),
        ),
        vertex=compose("vertex/mesh", dialect, {}, {"BOX_MM": box_mm}),
    )


def passes_of_rays(rays: Rays, grid: Grid, dialect: Dialect) -> tuple[PassText, ...]:
    """Return the passes that come before a picture because of how its rays begin."""
    return (mesh_pass(grid, dialect),) if rays == "mesh" else ()
