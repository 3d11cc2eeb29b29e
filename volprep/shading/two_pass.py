"""Ray casting in two passes over the faces of the volume's box.

Congote et al. (2011; mobile volume rendering thesis, section 6.5) draw back faces into a colour buffer and front faces
after them; the difference is the ray. A colour of 8 bits is off by up to 1/510 of the box along each axis, and where
the near plane cuts the box there is no front face and no picture.

Here the first pass says where rays enter, in a target of floats, or, in OpenGL ES 2.0, as a fraction of the ray in 24
bits; the second draws back faces, which every ray leaves through, also one that begins inside the box.
"""

from volprep.shading.compose import Slot, compose, literal
from volprep.shading.feature import Feature
from volprep.shading.raycast import BACKWARDS, ray_casting, samples_along
from volprep.shading.walk import PassText, TechniqueInput, Walk
from volprep_formats.package.program import Uniform

_CLIP_FROM_BOX = Uniform(name="u_clip_from_box", type="mat4x4f", source="clip_from_box")
_BOX_FROM_CLIP = Uniform(name="u_box_from_clip", type="mat4x4f", source="box_from_clip")


def two_pass(wanted: TechniqueInput) -> Walk:
    """Return rays whose first pass says exactly where they enter the box, or where they meet proxy geometry."""
    if wanted.program.rays == "mesh":
        return ray_casting(wanted)
    floats = wanted.dialect == "es300"
    slots: dict[str, Slot] = {
        "rays": "passes/from_faces",
        "rays_ends": "passes/from_faces:ends",
        "inside": "passes/from_faces:inside",
        "entry": "passes/from_faces:millimetres" if floats else "passes/from_faces:fraction",
    }
    own = Feature(slots, uniforms=(_BOX_FROM_CLIP,))
    if floats:
        entries = PassText(
            _positions(wanted, "millimetres", None), "front-faces", "u_entry", "rgba32f", (_CLIP_FROM_BOX,)
        )
    else:
        text = _positions(wanted, "fraction", "fraction_declared")
        entries = PassText(text, "front-faces", "u_entry", "rgba8", (_CLIP_FROM_BOX, _BOX_FROM_CLIP))
    return _walk(wanted, own, entries, place="whole")


def published_two_pass(wanted: TechniqueInput) -> Walk:
    """Return rays between a front face and a colour that encodes a position on a back face."""
    slots: dict[str, Slot] = {
        "rays": "passes/published",
        "rays_ends": "passes/published:ends",
        "inside": "passes/published:inside",
    }
    own = Feature(slots)
    text = _positions(wanted, "colour", "colour_declared")
    return _walk(wanted, own, PassText(text, "back-faces", "u_exit", "rgba8", (_CLIP_FROM_BOX,)), place="clipped")


def _walk(wanted: TechniqueInput, own: Feature, first: PassText, place: str) -> Walk:
    samples, step_mm_min = samples_along(wanted)
    box_mm = literal(*wanted.grid.extent_mm_zyx[::-1])
    backwards = wanted.program.compositing in BACKWARDS
    feature = Feature(
        slots={
            **samples.slots,
            **own.slots,
            "rays_start": None,
            "box": None,
            "cut": "ray/backwards" if backwards else None,
        },
        words={**samples.words, "NEAR_END": "near_end", "FAR_END": "far_end", "BOX_MM": box_mm},
        offers={"FIRST": "0.5", "FIRST_CELL": "cell_start", "FIRST_FRONT": "start"}
        | ({"FROM_VIEWER": "-ray"} if backwards else {}),
        uniforms=(_CLIP_FROM_BOX, *own.uniforms, *samples.uniforms),
    )
    return Walk(
        compose("passes/vertex", wanted.dialect, {"place": f"passes/vertex:{place}"}, {"BOX_MM": box_mm}),
        feature,
        step_mm_min,
        geometry="back-faces" if first.geometry == "front-faces" else "front-faces",
        before=(first,),
    )


def _positions(wanted: TechniqueInput, form: str, declared: str | None) -> str:
    part = "passes/positions"
    slots: dict[str, Slot] = {
        "dialect": f"ray/dialect_{wanted.dialect}",
        "declared": declared and f"{part}:{declared}",
        "position": f"{part}:{form}",
    }
    words = {"BOX_MM": literal(*wanted.grid.extent_mm_zyx[::-1])} if form == "colour" else {}
    return compose(part, wanted.dialect, slots, words)
