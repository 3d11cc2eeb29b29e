"""Faults as they are made, planted into shaders that are right, and what finds each of them: an order, or a law."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from order_bench import Bench, as_expected, expected_elsewhere, scatter
from order_scans import camera

from volprep.compositing import COMPOSITINGS
from volprep.lab.stress.combinations import Way
from volprep.truth.laws import broken_laws
from volprep.validation.comparison.altered import Altered
from volprep_formats.package.program import Blend, Program
from volprep_formats.package.reader import Package

ROUNDING = 2.0**-12
PIXELS = 24
SAMPLE = Way()
MOSAIC = Way(sampling="mosaic")
BRICKS = Way(sampling="bricks")
PIECES = Way(sampling="subvolumes")
SEGMENTS = Way(classification="preintegrated")
BACKWARDS = Way(compositing="back-to-front")


WORDS = {"steps": "order by step", "grids": "order by grid", "pixels": "order by pixel", "laws": "laws of light"}
"""What finds faults."""


@dataclass(frozen=True)
class Fault:
    """One fault."""

    name: str
    """What is wrong."""
    way: Way
    """Where it is planted."""
    plant: Callable[[Package, Program], Package]
    """Plants it."""
    found_by: tuple[str, ...]
    """What must find it."""


def instead(*changes: tuple[str, str]) -> Callable[[Package, Program], Package]:
    """Change the text of a fragment shader."""

    def plant(package: Package, program: Program) -> Package:
        text = package.read_text(program.fragment)
        for old, new in changes:
            assert old in text, f"{old} is not in {program.fragment}:\n{text}"
            text = text.replace(old, new)
        return Altered(package, {program.fragment: text})

    return plant


def blended(blend: Blend) -> Callable[[Package, Program], Package]:
    """Blend fragments in another way."""

    def plant(package: Package, program: Program) -> Package:
        return Altered(package, {}, program.model_copy(update={"blend": blend}))

    return plant


COUNT = "float count = ceil(max(steps - 0.001, min(steps, 0.001)));"
STRIDE = "position(ray * (part / max(count, 1.0)))"
SEGMENT = "float segment_mm = length_mm / max(count, 1.0);"
LIGHT = "colour += medium.rgb * (transmittance - remaining);"
WHOLE_STEPS = ((STRIDE, "position(ray * (part / max(steps, 1e-6)))"), (SEGMENT, "float segment_mm = u_step_mm;"))

FAULTS = (
    Fault("left sum", SAMPLE, instead(("float i = 0.5;", "float i = 0.0;")), ("steps",)),
    Fault("left sum, slab by slab", Way("slabs"), instead(("u_first_sample + 0.5", "u_first_sample")), ("steps",)),
    Fault("missing exponent", SAMPLE, instead(("exp(-depth)", "max(1.0 - depth, 0.0)")), ("steps", "grids")),
    Fault(
        "missing exponent in each step",
        BACKWARDS,
        instead(("exp(-medium.a * segment_mm)", "max(1.0 - medium.a * segment_mm, 0.0)")),
        ("steps",),
    ),
    Fault(
        "opacity not corrected for the step",
        SAMPLE,
        instead((SEGMENT, "const float segment_mm = 0.5;")),
        ("steps", "grids"),
    ),
    Fault(
        "forgotten spacing",
        SAMPLE,
        instead(
            ("float length_mm = part * length(ray);", "float length_mm = part * length(ray / vec3(1.1, 0.8, 1.4));")
        ),
        ("steps", "grids"),
    ),
    Fault(
        "last partial step dropped", SAMPLE, instead((COUNT, "float count = floor(steps);"), *WHOLE_STEPS), ("steps",)
    ),
    Fault("last partial step taken whole", SAMPLE, instead(*WHOLE_STEPS), ("steps",)),
    Fault(
        "light that a segment absorbs itself is counted",
        SAMPLE,
        instead((LIGHT, "colour += medium.rgb * medium.a * segment_mm * transmittance;")),
        ("steps",),
    ),
    Fault(
        "light that a pre-integrated segment absorbs itself is counted",
        SEGMENTS,
        instead((LIGHT, "colour += medium.rgb * medium.a * segment_mm * transmittance;")),
        ("steps", "grids"),
    ),
    Fault(
        "light not attenuated by the samples in front",
        SAMPLE,
        instead((LIGHT, "colour += medium.rgb * (1.0 - exp(-medium.a * segment_mm));")),
        ("steps", "laws"),
    ),
    Fault(
        "colour not premultiplied",
        SAMPLE,
        instead(("vec4(colour, 1.0", "vec4(colour / (1.0 - transmittance), 1.0")),
        ("laws",),
    ),
    Fault(
        "share of an entry forgotten at the front of a segment",
        SEGMENTS,
        instead((" - front.growth * front.share", "")),
        ("steps",),
    ),
    Fault("front not handed on to the next segment", SEGMENTS, instead(("  front = back;\n", "")), ("steps",)),
    Fault(
        "half a voxel lost",
        SAMPLE,
        instead(("textureLod(u_volume, at,", "textureLod(u_volume, at + 0.5 / vec3(textureSize(u_volume, 0)),")),
        ("steps", "grids"),
    ),
    Fault("half a slice lost in a mosaic", MOSAIC, instead(("clamp(at.z - 0.5,", "clamp(at.z,")), ("steps", "grids")),
    Fault(
        "row of a tile found with another number of columns",
        MOSAIC,
        instead(("floor((tile + 0.5) / TILES_X)", "floor((tile + 0.5) / (TILES_X + 1.0))")),
        ("steps", "grids"),
    ),
    Fault(
        "filter reaches into the next tile", MOSAIC, instead(("clamp(at, vec2(0.5), PITCH - 0.5)", "at")), ("steps",)
    ),
    Fault(
        "square root of a table of bytes forgotten",
        MOSAIC,
        instead(("entry.a * entry.a", "entry.a")),
        ("steps", "grids"),
    ),
    Fault("half a voxel lost in bricks", BRICKS, instead(("clamp(at - 0.5,", "clamp(at,")), ("steps", "grids")),
    Fault(
        "bricks hold no voxels of their neighbours",
        BRICKS,
        instead(
            ("clamp(voxel - brick * CELLS, vec3(0.0), CELLS)", "clamp(voxel - brick * CELLS, vec3(0.5), CELLS - 0.5)")
        ),
        ("steps",),
    ),
    Fault("pieces share no voxels", PIECES, instead(("step(u_split, at);", "step(u_split + 0.5, at);")), ("steps",)),
    Fault(
        "half a pixel lost",
        SAMPLE,
        instead(
            ("v_near.xyz / v_near.w", "(v_near + 0.5 * dFdx(v_near)).xyz"),
            ("v_far.xyz / v_far.w", "(v_far + 0.5 * dFdx(v_far)).xyz / (v_far + 0.5 * dFdx(v_far)).w"),
        ),
        ("pixels",),
    ),
    Fault(
        "rays not cut where they leave the box",
        SAMPLE,
        instead(("min(min(leave.x, leave.y), min(leave.z, 1.0))", "1.0")),
        ("steps", "grids"),
    ),
    Fault(
        "rays of two passes not turned round",
        Way("two-pass", "back-to-front"),
        instead(("origin += ray;\n", ""), ("ray = -ray;\n", ""), ("inside = 1.0 - inside.yx;\n", "")),
        ("steps",),
    ),
    Fault(
        "a sample of each slab lost",
        Way("slabs"),
        instead(("u_first_sample + 40.0", "u_first_sample + 39.0")),
        ("steps",),
    ),
    Fault(
        "layers blended over the layers in front",
        Way("view-slices"),
        blended(
            Blend(order="front-to-back", colour=("ONE", "ONE_MINUS_SRC_ALPHA"), alpha=("ONE", "ONE_MINUS_SRC_ALPHA"))
        ),
        ("steps", "grids"),
    ),
    Fault(
        "opacities of layers added",
        Way("view-slices"),
        blended(Blend(order="front-to-back", colour=("ONE_MINUS_DST_ALPHA", "ONE"), alpha=("ONE", "ONE"))),
        ("steps", "laws"),
    ),
    Fault(
        "sRGB taken for linear",
        SAMPLE,
        instead((LIGHT, LIGHT.replace("medium.rgb", "pow(medium.rgb, vec3(2.2))"))),
        ("steps",),
    ),
    Fault(
        "mean over the steps but one",
        Way(compositing="average"),
        instead(("sum / max(count, 1.0)", "sum / max(count - 1.0, 1.0)")),
        ("steps",),
    ),
    Fault(
        "maximum of every other face",
        Way(compositing="maximum"),
        instead(("faces + 1.0", "faces + 2.0"), ("step(ahead, vec3(reached))", "2.0 * step(ahead, vec3(reached))")),
        ("steps",),
    ),
    Fault(
        "isovalue in another unit",
        Way(compositing="isosurface"),
        instead(("const float ISOVALUE = ", "const float ISOVALUE = 0.9 * ")),
        ("steps", "grids"),
    ),
)


def finders(bench: Bench, fault: Fault, *, planted: bool = True) -> Iterator[str]:
    """Return what finds a fault: each order that is not the expected one, and the laws."""
    way, plant = fault.way, fault.plant if planted else None
    if not as_expected(way, bench.by_step(way, plant)):
        yield "steps"
    least = (expected_elsewhere(way) or 0.0) - scatter(way)
    if bench.by_grid(way, plant).order < least:
        yield "grids"
    if not COMPOSITINGS[way.compositing].isovalue and bench.by_pixel(way, plant).order < least:
        yield "pixels"
    if any(_laws(bench, fault, planted=planted)):
        yield "laws"


def _laws(bench: Bench, fault: Fault, *, planted: bool) -> Iterator[str]:
    """Return the laws that pictures break, at a coarse step and a fine one."""
    package = bench.package(fault.way)
    with bench.renderer(package, fault.way, fault.plant if planted else None) as renderer:
        for step_mm in (1.6, 0.4):
            yield from broken_laws(renderer.render(camera(package), (PIXELS, PIXELS), step_mm), ROUNDING)
