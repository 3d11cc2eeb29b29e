"""Stacks of layers that are blended: what a ray has of a layer is one sample, weighted by its length.

Slices across the view lie in a cube around the volume whose edge is the diagonal (Noguera and Jiménez 2012, section
3.2, after Van Gelder and Kim 1996): the cube turns with the viewer, so that its layers are made once. There a slice has
the opacity of the transfer function divided by the number of slices, and opacities are added: neither converges to the
integral of emission and absorption. Here a fragment has the opacity of the way that its ray has in the layer, at the
rim of the volume and in perspective too, and is blended front to back.

Slices across an axis of the volume (mobile volume rendering thesis, section 2.2.3) need no stack of textures for each
axis here, and may be as close as wanted: a fragment mixes the two slices of the mosaic that it lies between.
"""

import math

from volprep.shading.compose import Dialect, Slot, compose
from volprep.shading.feature import Feature
from volprep.shading.walk import TechniqueInput, Walk
from volprep_formats.package.program import Blend, Geometry, PassTarget, Uniform

MOST_LAYERS = 2**14
"""More layers than that are more than any framebuffer can tell apart."""
UNDER = Blend(order="front-to-back", colour=("ONE_MINUS_DST_ALPHA", "ONE"), alpha=("ONE_MINUS_DST_ALPHA", "ONE"))
"""The background counts as far as the foreground lets it through; fragments are premultiplied."""
OVER = Blend(order="back-to-front", colour=("ONE", "ONE_MINUS_SRC_ALPHA"), alpha=("ONE", "ONE_MINUS_SRC_ALPHA"))
"""The foreground hides the background. Fragments are premultiplied."""
TOWARDS = Blend(order="front-to-back", colour=OVER.colour, alpha=OVER.alpha)
"""Opacities of layers together, from the light on: in which order they come does not matter."""
AS_PUBLISHED = Blend(order="front-to-back", colour=("ONE_MINUS_DST_ALPHA", "ONE"), alpha=("ONE", "ONE"))
"""Opacities are added. Fragments are premultiplied."""


def view_slices(wanted: TechniqueInput) -> Walk:
    """Return layers across the view, or, where the light has to go through them, too, across the half angle."""
    light = wanted.program.light
    return _layers("half-angle-slices" if light and light.shadows == "half-angle" else "view-slices", wanted)


def axis_slices(wanted: TechniqueInput) -> Walk:
    """Return layers across the axis of the volume that faces the viewer most."""
    return _layers("axis-slices", wanted)


def published_view_slices(wanted: TechniqueInput) -> Walk:
    """Return slices across the view as Noguera and Jiménez have them."""
    part = "slices/published"
    slots: dict[str, Slot] = {"steps": f"{part}:uniform", "cut": f"{part}:cut", "count": f"{part}:count"}
    walk = _layers("view-slices", wanted)
    feature = Feature({**walk.feature.slots, **slots}, walk.feature.words, walk.feature.offers, walk.feature.uniforms)
    return Walk(
        walk.vertex,
        feature,
        walk.step_mm_min,
        geometry=walk.geometry,
        blend=AS_PUBLISHED,
        loops=False,
        compositing=part,
    )


def layer_target(dialect: Dialect) -> PassTarget:
    """Return the format of the picture that layers are blended in.

    The rounding of hundreds of faint layers adds up: RMSE of heads and an engine with steps of a voxel 2.6, 2.2 and
    1.4/255 in 8 bits, 1.8, 0.9 and 0.6/255 in half floats, in which finer steps are better still.
    """
    return "rgba8" if dialect == "es100" else "rgba16f"


def _layers(geometry: Geometry, wanted: TechniqueInput) -> Walk:
    along = geometry == "axis-slices"
    slots: dict[str, Slot] = {
        "rays": "slices/layer",
        "rays_ends": "slices/layer:ends",
        "rays_start": None,
        "steps": None,
        "cut": "slices/layer:cut",
        "layer_sides": "slices/layer:either" if along else "slices/layer:ordered",
        "count": "slices/layer:count",
        "loop": "slices/layer:one",
    }
    feature = Feature(
        slots=slots,
        words={"NEAR_END": "near_end", "FAR_END": "far_end"},
        offers={"FIRST_FRONT": "start"},
        uniforms=(
            Uniform(name="u_box_from_clip", type="mat4x4f", source="box_from_clip"),
            Uniform(name="u_clip_from_box", type="mat4x4f", source="clip_from_box"),
            Uniform(name="u_box_from_slices", type="mat4x4f", source="box_from_slices"),
            Uniform(name="u_slices", type="f32", source="slices"),
        ),
    )
    return Walk(
        compose("slices/vertex", wanted.dialect, {"layers": f"slices/vertex:{'along' if along else 'across'}"}, {}),
        feature,
        math.hypot(*wanted.grid.extent_mm_zyx) / MOST_LAYERS,
        geometry=geometry,
        blend=UNDER,
        target=layer_target(wanted.dialect),
        loops=False,
    )
