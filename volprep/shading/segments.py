"""A scan with its segments in one picture: labels and their looks beside the values, each style a transfer function.

Labels are read with one fetch where all eight voxels around a place have one label, with eight elsewhere. Where a voxel
absorbs little and steps are shorter than voxels, unlit pictures read labels once for two or four samples, halfway
between them (`groups`). Lit ones read so the normal of two samples: at borders its 27 labels took as long as the rest.

With a maximum or a first hit a ray shows one value. The program then reads the scan without its hidden voxels.

Mesa's software driver runs both sides of every branch. Read for each sample, labels make it take 3.2 times as long as
one of the scan alone: eight labels with their weights alone make 1.96, eight looks, two styles and sums the rest. Read
once for two samples, 2.3. Other attempts are in docs/MEASURED.md.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import reduce
from itertools import accumulate, groupby

from volprep.shading import raycast_subvolumes
from volprep.shading.classification import sample_classification
from volprep.shading.components import component_letter
from volprep.shading.compose import Dialect, Instance, Slot, literal
from volprep.shading.feature import Feature
from volprep.shading.groups import group_size
from volprep.shading.mosaic import Mosaic
from volprep.shading.raycast import BACKWARDS
from volprep.shading.walk import Walk
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.parts.segments.record import HIDDEN_BELOW, OF_ONE_VALUE, SAME, Segments, table_shape
from volprep_formats.package.parts.segments.texels import FLAG_BITS
from volprep_formats.package.parts.subvolumes.record import SubvolumeGrid
from volprep_formats.package.program import ProgramDesign, RaySampling, Sampler

_PART = "classification/segments"
_VALUES = "classification/segments_values"
_SOFT_DEPTH = 0.05
"""Optical depth of four samples that share labels; two samples may have twice this depth, lit or not."""
_LIT_GROUP = 2
"""Most lit samples that share a normal. With four a picture of a CT took as long, and was 0.0018 off in place of 0.0008
where slopes of borders alone were shared."""
_BYTES = {False: "({texel}).{low} * 255.0", True: "dot(({texel}).{low}{high}, vec2(255.0, 65280.0))"}
"""A texel as a number, by whether labels have two bytes."""


def drawn_with_segments(
    manifest: Manifest,
    program: ProgramDesign,
    sampling: Feature,
    pieces: SubvolumeGrid | None = None,
    *,
    group: int = 1,
) -> tuple[Feature, Feature]:
    """Return how a program samples the scan, and how it classifies samples by label; `pieces` hold their labels.

    So many samples make a `group`. Unlit groups read labels once, lit ones normals.
    """
    segments = manifest.segments
    assert segments is not None  # noqa: S101 - a picture of labels has them
    volume = tuple(replaced(sampler, segments.transfers[0]) for sampler in sampling.samplers)
    dialect = manifest.profile.dialect
    classify: list[Instance] = []
    samplers: list[Sampler] = []
    for index, transfer in enumerate(segments.transfers):
        own = sample_classification(manifest, program.classification, transfer, f"_{index}", dialect)
        part = own.slots["classification"]
        assert isinstance(part, tuple)  # noqa: S101 - a function of samples is an instance
        classify += part
        samplers += [replaced(sampler, transfer) for sampler in own.samplers]
    is_lit = program.lighting != "none"
    labels = _labels(manifest, segments, program) if pieces is None else _labels_of(pieces, manifest.profile.dialect)
    words = {**labels.words, "FLAG": literal(2 ** FLAG_BITS[segments.wide]), "ENTRY": _entry(len(segments.labels))}
    slots: dict[str, Slot] = {
        "channels": tuple(classify),
        "labels": f"{_PART}:labels",
        "around": f"{_PART}:around",
        "corner_labels": f"{_PART}:{'each_corner' if pieces is None else 'corners_in_turn'}",
        **labels.slots,
    }
    if program.compositing in OF_ONE_VALUE:
        slots |= {
            "classification": _VALUES,
            "valued": f"{_VALUES}:value",
            "shown": f"{_VALUES}:{segments.border}",
            "value_near": None,
            **_values(segments),
        }
        slots["weight"] = f"{_VALUES}:weight" if segments.border == "crisp" else None
        # Gradients of the visible values.
        offers = {"STORED": "scan_value", "NEAR": "stored_value", "AROUND": "", "HIDDEN": literal(-HIDDEN_BELOW)}
        offers["SAME"] = literal(SAME)
        offers["OF_POSITION"] = "" if program.sampling != "texture3d" else words["OF_VOXELS"]
    else:
        styles = _styles(segments, is_lit=is_lit, group=group)
        words["MEDIA"] = ", ".join(f"vec4 medium_{index}" for index in range(len(segments.transfers)))
        slots |= {"classification": _PART, "classification_start": None, **styles, **_lit(segments, is_lit=is_lit)}
        slots |= _of_lit_group(segments, group) if is_lit and group > 1 else {}
        slots["border_row"] = f"{_PART}:{'each_of_row' if pieces is None else 'row_in_turn'}" if is_lit else None
        read = ", ".join(f"media_{index}[k]" for index in range(len(segments.transfers)))
        at = "start + stride * i"
        offers = {"MEDIUM": f"classify_segments({at})", "NORMAL": f"normal_at({at}) + border_slope()"}
        if group > 1:
            offers = {"MEDIUM": "media[k]" if is_lit else f"seen({read})", "NORMAL": "gradient + bordered[k] * slope"}
    classified = Feature(
        slots=slots,
        words=words,
        offers=offers,
        samplers=(*samplers, *labels.samplers, Sampler(name="u_segments", role="looks")),
    )
    return replace(sampling, samplers=volume), classified


def samples_of_group(manifest: Manifest, program: ProgramDesign, rays: RaySampling, walk: Walk) -> int:
    """Return for how many samples a program reads labels or, lit, normals once; 1 if each has its own.

    They are at most half a voxel apart, and absorb little even where a style is densest: with 2 per mm and steps of
    0.35 mm, lit samples in pairs made FLIP of a head 0.014 in place of 0.009. Unlit borders are mixed, since a crisp
    one is a step. Lit samples keep labels of their own, since a border is shaded as soon as labels meet: with shared
    labels FLIP was 0.031 in place of 0.003 on a small scan. Shadow rays classify samples of their own. Groups of pieces
    would begin elsewhere than groups of the whole, and so would lit groups from the far end of a ray.
    """
    segments, picture = manifest.segments, manifest.picture(program.transfer)
    if segments is None or picture is None or picture.mixing != "labels" or not walk.loops:
        return 1
    if program.compositing in OF_ONE_VALUE or program.sampling == "subvolumes":
        return 1
    is_lit = program.lighting != "none"
    has_shadows = program.light is not None and program.light.shadows != "none"
    lit_alone = has_shadows or program.compositing in BACKWARDS
    if lit_alone if is_lit else segments.border == "crisp":
        return 1
    functions = (function for function in manifest.transfer_functions if function.name in segments.transfers)
    largest_per_mm = max(point.extinction_per_mm for function in functions for point in function.points)
    soft_mm = _SOFT_DEPTH / max(largest_per_mm, 1e-9)
    levels = (level for level in manifest.levels if level.index in program.levels)
    longest_mm = {level.index: min(0.5 * min(level.grid.spacing_mm_zyx), soft_mm) for level in levels}
    size = group_size(mm / rays.step_of(level) for level, mm in longest_mm.items())
    return min(size, _LIT_GROUP) if is_lit else size


def values_alone(classified: Feature) -> tuple[Feature, ...]:
    """Return how a shadow map reads values without hidden voxels; nothing without labels, whose looks decide on them.

    It has no colours, and no tables of them.
    """
    slots: dict[str, Slot] = {**classified.slots, "classification": f"{_VALUES}:value"}
    samplers = tuple(sampler for sampler in classified.samplers if sampler.role in {"labels", "looks"})
    return (replace(classified, slots=slots, samplers=samplers),) if samplers else ()


def _labels_of(pieces: SubvolumeGrid, dialect: Dialect) -> Feature:
    """Return how labels are read from sub-volumes: their texels hold them, and are sampled anyway."""
    texels, code = raycast_subvolumes.labels(pieces, dialect)
    return Feature(slots={"texels": texels}, words={"CODE": code, "PLACE": "at", "OF_VOXELS": ""})


def _labels(manifest: Manifest, segments: Segments, program: ProgramDesign) -> Feature:
    """Return how labels are read: from a 3D texture, or from a mosaic of one slice in a texel.

    Labels use the positions of the volume: voxels, or texture coordinates.
    """
    level, wide, in_voxels = min(program.levels), segments.wide, program.sampling != "texture3d"
    texture = next(texture for texture in manifest.textures if (texture.role, texture.level) == ("labels", level))
    low, high = (component_letter(texture.format, component, manifest.profile.dialect) for component in (0, 1))
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


def _values(segments: Segments) -> dict[str, Slot]:
    """Return how a shader that shows one value chooses among styles."""
    each = _each(segments)
    firsts = zip(each[1:], _firsts(segments), strict=True)
    return {
        "media": _instances("media", each),
        "chosen": tuple(
            Instance(f"{_PART}:chosen", {**words, "FIRST": literal(first - 0.5)}) for words, first in firsts
        ),
    }


def _styles(segments: Segments, *, is_lit: bool, group: int) -> dict[str, Slot]:
    """Return what a shader does for each style, at one sample or at a group of samples."""
    each = _each(segments)
    shares = [_share(segments, index, "label") for index in range(len(each))]
    slots: dict[str, Slot] = {
        "styles": _instances("style", each),
        "one_label": f"{_PART}:one_label",
        "own_sums": tuple(
            Instance(f"{_PART}:own_sum", {**words, "SHARE": share}) for words, share in zip(each, shares, strict=True)
        ),
        "borders": f"{_PART}:{segments.border}",
        "added": _instances("added", each),
        **(_of_group(each) if group > 1 and not is_lit else _of_sample(each, is_lit=is_lit)),
    }
    if segments.border == "crisp":
        return slots
    return {
        **slots,
        "no_sums": _instances("no_sum", each),
        "corners": tuple(part for side in ("near", "far") for part in _corner(segments, side)),
    }


def _of_sample(each: Sequence[dict[str, str]], *, is_lit: bool) -> dict[str, Slot]:
    """Return how styles and labels are read at one sample."""
    media = [f"medium{words['OF']}" for words in each]
    shown = reduce("max({}, {})".format, (f"{medium}.a" for medium in media))
    return {
        "in_turns": (Instance(f"{_PART}:single", {"ARGUMENTS": ", ".join(media)}),),
        "media": _instances("media", each),
        "shown": (Instance(f"{_PART}:shown", {"SHOWN": shown}),),
        "kept": _instances("kept", each) if is_lit else None,
    }


def _of_group(each: Sequence[dict[str, str]]) -> dict[str, Slot]:
    """Return how the styles of a group of samples are read, and labels once for all of them."""
    return {
        "in_turns": None,
        "of_group": f"{_PART}:group",
        "declared": _instances("declared", each),
        "media": _instances("media_of_group", each),
    }


def _of_lit_group(segments: Segments, group: int) -> dict[str, Slot]:
    """Return how a lit group classifies its samples, one after the other, and takes their normal."""
    samples = tuple(Instance(f"{_PART}:lit_sample", {"K": str(k)}) for k in range(group))
    kept = {part: _instances(part, _each(segments)) for part in ("shared", "add_kept", "keep_shared")}
    return {"of_group": f"{_PART}:lit_group", "lit_samples": samples, **kept}


def _lit(segments: Segments, *, is_lit: bool) -> dict[str, Slot]:
    """Return what gives a normal to the borders of labels; nothing where nothing is lit."""
    if not is_lit:
        return dict.fromkeys(("lit_segments", "no_border", "border", "border_slope"))
    each = _each(segments)
    kept = ", ".join(f"kept{words['OF']}" for words in each)
    firsts = zip(each[1:], _firsts(segments), strict=True)
    return {
        **{part: f"{_PART}:{part}" for part in ("no_border", "border")},
        "lit_segments": (Instance(f"{_PART}:lit_segments", {"KEPT": kept}),),
        "border_slope": f"{_PART}:slope",
        "seen_chosen": tuple(
            Instance(f"{_PART}:seen_chosen", {**words, "FIRST": literal(first - 0.5)}) for words, first in firsts
        ),
    }


def _instances(section: str, each: Sequence[dict[str, str]]) -> tuple[Instance, ...]:
    return tuple(Instance(f"{_PART}:{section}", words) for words in each)


def _corner(segments: Segments, side: str) -> Iterator[Instance]:
    """Add the look of a voxel to the sum of its style."""
    yield Instance(f"{_PART}:corner", {"SIDE": side})
    for index, words in enumerate(_each(segments)):
        share = _share(segments, index, f"labels_{side}[corner]")
        yield Instance(f"{_PART}:corner_sum", {**words, "SIDE": side, "SHARE": share})


def _share(segments: Segments, style: int, label: str) -> str:
    """Return the factors which are 1 for labels of a style, else 0."""
    ends = _firsts(segments)
    conditions = [f"step({literal(ends[style - 1] - 0.5)}, {label})"] if style else []
    conditions += [f"step({label}, {literal(ends[style] - 0.5)})"] if style < len(ends) else []
    return "".join(f" * {condition}" for condition in conditions)


def _each(segments: Segments) -> list[dict[str, str]]:
    """Return the words of each style."""
    return [{"OF": f"_{index}"} for index in range(len(segments.transfers))]
