"""A scan with its segments in one picture: labels and their looks beside the values, each style a transfer function.

Labels are read with one fetch where all eight voxels around a sample have one label, with eight elsewhere.

With a maximum or a first hit a ray shows one value. The program then reads the scan without its hidden voxels.

Mesa's software driver runs both sides of every branch, so that each sample takes 3.3 times as long as one of the scan
alone: eight labels with their weights alone make 1.96, eight looks, two styles and sums the rest. Tried and not faster
or no better in quality (a cube of 96³ voxels, 192² to 768² pixels, lookup tables; tests/benchmarks/bench_segments.py):
loops over corners with one turn where a cell has one label 4.3 to 5.2; runs of such cells in a loop of their own 6.8 to
8.1; one table of values and labels in place of styles and looks 2.8 with nearest entries, 5.5 with linear ones;
constant offsets of fetches 3.3. Without the flag in the labels it would be 2.85.

A sample with one label and one look, without any border in the shader, already takes 1.74 to 1.83 with two styles and
1.45 with one, so that no way to leave out work at borders reaches 1.7. Four samples at once and then a loop over those
that have several labels: 2.25 in place of 3.17 where no cell has, 2.60 in place of 3.19 where 9 % have, but 3.59 in
place of 3.23 where 36 % have and 3.34 in place of 2.87 in a head where 49 % have, since one of eight pixels nearly
always is at a border. The least and the greatest label of a cell, and a loop over others: 3.47. Integer coordinates
(texelFetch): 4.1. The sums of a style as those of all less the others, and no early ends: 2.96, but all other drivers
would then read eight labels for every sample. Lit borders that read only the 19 voxels beside the eight of the cell
take as long as with all 27: weights take as long as labels. Rows of three voxels take 2.66 in place of 3.04.

More memory does not reach 1.7 either. A label costs 0.2, a look 0.08, the table of a second style 0.33. A texel of four
bytes for each cell with two labels and a bit for each corner, read once, takes 1.73 with one style and 2.08 with two,
and lacks cells of three and more labels, 7 % there. With a table of values and labels it takes 1.87, or 1.6 with
nearest values. A label and two bytes for each cell take 2.2. A loop that ends before its first turn is no way out: the
driver tests the mask of a loop after each turn, so that a loop of no turns costs one, and one of one turn two (2.75 in
place of 2.2, and 10 with another one for the third label). Eight labels in two texels take 2.6.

Nor do loops of their own for blocks of one look, without labels: too few blocks have one. Of the voxels of the regions
9 % lie in blocks of 4³ cells with one label and none in such of 8³, of the organs 66 and 41 %, of the head 16 and 3 %.
Each block costs a turn of the other loop, so that only organs could win.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import accumulate, groupby, pairwise

from volprep.shading import raycast_subvolumes
from volprep.shading.classification import sample_classification
from volprep.shading.components import component_letter
from volprep.shading.compose import Instance, Slot, literal
from volprep.shading.feature import Feature
from volprep.shading.mosaic import Mosaic
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.parts.segments.record import (
    HIDDEN_BELOW,
    OF_ONE_VALUE,
    SAME,
    Segments,
    table_shape,
)
from volprep_formats.package.parts.segments.texels import FLAG_BITS
from volprep_formats.package.parts.subvolumes.record import SubvolumeGrid
from volprep_formats.package.program import ProgramDesign, Sampler

_PART = "classification/segments"
_VALUES = "classification/segments_values"
_BYTES = {False: "({texel}).{low} * 255.0", True: "dot(({texel}).{low}{high}, vec2(255.0, 65280.0))"}
"""A texel as a number, by whether labels have two bytes."""


def drawn_with_segments(
    manifest: Manifest,
    segments: Segments,
    program: ProgramDesign,
    sampling: Feature,
    pieces: SubvolumeGrid | None = None,
) -> tuple[Feature, Feature]:
    """Return how a program samples the scan, and how it classifies samples by label; `pieces` hold their labels."""
    volume = tuple(replaced(each, segments.transfers[0]) for each in sampling.samplers)
    dialect = manifest.profile.dialect
    classify: list[Instance] = []
    samplers: list[Sampler] = []
    for index, transfer in enumerate(segments.transfers):
        own = sample_classification(manifest, program.classification, transfer, f"_{index}", dialect)
        part = own.slots["classification"]
        assert isinstance(part, tuple)  # noqa: S101 - a function of samples is an instance
        classify += part
        samplers += [replaced(each, transfer) for each in own.samplers]
    is_lit = program.lighting != "none"
    labels = _labels(manifest, segments, program) if pieces is None else _labels_of(pieces)
    words = {
        **labels.words,
        "FLAG": literal(2 ** FLAG_BITS[segments.wide]),
        "ENTRY": _entry(len(segments.labels)),
    }
    slots: dict[str, Slot] = {
        "channels": tuple(classify),
        "labels": f"{_PART}:labels",
        "around": f"{_PART}:around",
        "corner_labels": f"{_PART}:{'each_corner' if pieces is None else 'corners_in_turn'}",
        **labels.slots,
        **_styles(segments),
    }
    if program.compositing in OF_ONE_VALUE:
        slots |= {
            "classification": _VALUES,
            "valued": f"{_VALUES}:value",
            "shown": f"{_VALUES}:{segments.border}",
            "value_near": None,
        }
        slots["weight"] = f"{_VALUES}:weight" if segments.border == "crisp" else None
        # Gradients of the visible values.
        offers = {"STORED": "scan_value", "NEAR": "stored_value", "OF": "", "HIDDEN": literal(-HIDDEN_BELOW)}
        offers["SAME"] = literal(SAME)
        offers["OF_POSITION"] = "" if program.sampling != "texture3d" else words["OF_VOXELS"]
    else:
        slots |= {"classification": _PART, "classification_start": None, **_lit(segments, is_lit=is_lit)}
        slots["border_row"] = f"{_PART}:{'each_of_row' if pieces is None else 'row_in_turn'}" if is_lit else None
        offers = {"MEDIUM": "classify_segments(start + stride * i)"}
        offers |= {"BORDER": " + border_slope()"} if is_lit else {}
    classified = Feature(
        slots=slots,
        words=words,
        offers=offers,
        samplers=(*samplers, *labels.samplers, Sampler(name="u_segments", role="looks")),
    )
    return replace(sampling, samplers=volume), classified


def values_alone(classified: Feature) -> Feature:
    """Return how a shadow map reads values without hidden voxels: no colours, and no tables of them."""
    slots: dict[str, Slot] = {**classified.slots, "classification": f"{_VALUES}:value"}
    samplers = tuple(each for each in classified.samplers if each.role in {"labels", "looks"})
    return replace(classified, slots=slots, samplers=samplers)


def _labels_of(pieces: SubvolumeGrid) -> Feature:
    """Return how labels are read from sub-volumes: their texels hold them, and are sampled anyway."""
    texels, code = raycast_subvolumes.labels(pieces)
    return Feature(slots={"texels": texels}, words={"CODE": code, "PLACE": "at", "OF_VOXELS": ""})


def _labels(manifest: Manifest, segments: Segments, program: ProgramDesign) -> Feature:
    """Return how labels are read: from a 3D texture, or from a mosaic of one slice in a texel.

    Labels use the positions of the volume: voxels, or texture coordinates.
    """
    level, wide, in_voxels = min(program.levels), segments.wide, program.sampling != "texture3d"
    texture = next(each for each in manifest.textures if (each.role, each.level) == ("labels", level))
    low, high = (component_letter(texture.gl.format, component) for component in (0, 1))
    if texture.mosaic is None:
        texel = "textureLod(u_labels, at, 0.0)"
        return Feature(
            slots={"texels": f"{_PART}:texture3d"},
            words={
                "CODE": _BYTES[wide].format(texel=texel, low=low, high=high),
                "PLACE": "at" if in_voxels else "at * vec3(textureSize(u_labels, 0))",
                "OF_VOXELS": " / vec3(textureSize(u_labels, 0))",
            },
            samplers=(Sampler(name="u_labels", role="labels"),),
        )
    mosaic = Mosaic(
        "The labels as a mosaic, in tiles of one slice each.",
        texture.mosaic,
        sampler="u_labels",
        role="labels",
        texel="label_tile_texel",
        prefix="LABEL_",
    )
    return Feature(
        slots={"texels": (mosaic.texels, mosaic.voxels("label_texel", "nearest"))},
        words={
            "CODE": _BYTES[wide].format(texel="label_texel(at)", low=low, high=high),
            "PLACE": "at",
            "OF_VOXELS": "",
        },
        samplers=mosaic.samplers,
    )


def _entry(labels: int) -> str:
    """Return where the look of a label lies in its table."""
    rows, columns = table_shape(labels)
    if rows == 1:
        return f"vec2((label + 0.5) * {literal(1 / columns)}, 0.5)"
    row = f"floor((label + 0.5) * {literal(1 / columns)})"
    return f"vec2(fract((label + 0.5) * {literal(1 / columns)}), ({row} + 0.5) * {literal(1 / rows)})"


def replaced(sampler: Sampler, transfer: str) -> Sampler:
    """Return a sampler that belongs to a transfer function."""
    return sampler.model_copy(update={"transfer": transfer})


def _firsts(segments: Segments) -> list[int]:
    """Return the first label of each style but the first. Labels of one style stand next to each other."""
    counts = [len([*labels]) for _, labels in groupby(segments.labels, key=lambda label: label.transfer)]
    return list(accumulate(counts))[:-1]


def _styles(segments: Segments) -> dict[str, Slot]:
    """Return what a shader does for each style."""
    ends = [*_firsts(segments), len(segments.labels)]
    each = [{"OF": f"_{index}"} for index in range(len(ends))]
    shown = "medium_0.a"
    for words in each[1:]:
        shown = f"max({shown}, medium{words['OF']}.a)"
    slots: dict[str, Slot] = {
        "media": _instances("media", each),
        "shown": (Instance(f"{_PART}:shown", {"SHOWN": shown}),),
        "chosen": tuple(
            Instance(f"{_PART}:chosen", {"OF": words["OF"], "FIRST": literal(end - 0.5)})
            for words, end in zip(each[1:], ends, strict=False)
        ),
        "borders": f"{_PART}:{segments.border}",
    }
    if segments.border == "crisp":
        return slots
    return {
        **slots,
        "sums": _instances("sum", each),
        "corners": tuple(part for side in ("near", "far") for part in _corner(side, ends)),
        "added": _instances("added", each),
    }


def _lit(segments: Segments, *, is_lit: bool) -> dict[str, Slot]:
    """Return what gives a normal to the borders of labels; nothing where nothing is lit."""
    if not is_lit:
        return dict.fromkeys(("lit_segments", "no_border", "border", "border_slope"))
    each = [{"OF": f"_{index}"} for index in range(len(segments.transfers))]
    kept = ", ".join(f"kept{words['OF']}" for words in each)
    firsts = zip(each[1:], _firsts(segments), strict=True)
    return {
        **{part: f"{_PART}:{part}" for part in ("no_border", "border")},
        "lit_segments": (Instance(f"{_PART}:lit_segments", {"KEPT": kept}),),
        "border_slope": f"{_PART}:slope",
        "keep": _instances("keep", each),
        "seen_chosen": tuple(
            Instance(f"{_PART}:seen_chosen", {**words, "FIRST": literal(first - 0.5)}) for words, first in firsts
        ),
    }


def _instances(section: str, each: Sequence[dict[str, str]]) -> tuple[Instance, ...]:
    return tuple(Instance(f"{_PART}:{section}", words) for words in each)


def _corner(side: str, ends: Sequence[int]) -> Iterator[Instance]:
    """Add the look of a voxel to the sum of its style."""
    yield Instance(f"{_PART}:corner", {"SIDE": side})
    label = f"labels_{side}[corner]"
    for index, (first, end) in enumerate(pairwise([0, *ends])):
        conditions = [f"step({literal(first - 0.5)}, {label})"] if index else []
        conditions += [f"step({label}, {literal(end - 0.5)})"] if index < len(ends) - 1 else []
        share = "".join(f" * {condition}" for condition in conditions)
        yield Instance(f"{_PART}:corner_sum", {"OF": f"_{index}", "SIDE": side, "SHARE": share})
