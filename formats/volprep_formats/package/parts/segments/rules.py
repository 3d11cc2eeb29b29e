"""Whether the segments of a manifest agree with its textures, programs and transfer functions."""

import math
from collections import Counter
from collections.abc import Iterator
from itertools import groupby

from volprep_formats.package.manifest import Manifest
from volprep_formats.package.parts.segments.label_sets import sets_shape
from volprep_formats.package.parts.segments.record import COMPOSITED, SAMPLED, Segments, table_shape
from volprep_formats.package.program import Program
from volprep_formats.package.texture import COMPONENTS, Texture

PIECES = 8
"""Sub-volumes that a program samples: those around a point."""


def segments_contradictions(manifest: Manifest) -> Iterator[str]:
    """Return every problem of the picture of a scan with its segments."""
    segments = manifest.segments
    textures = [each for each in manifest.textures if each.role in {"labels", "looks", "label-sets"}]
    if segments is None:
        yield from (f"texture {each.name} has the role {each.role}, but there are no segments" for each in textures)
        return
    yield from _names(manifest, segments)
    for texture in textures:
        yield from (f"texture {texture.name} {problem}" for problem in _texture(manifest, segments, texture))
    programs = [program for program in manifest.programs if program.transfer == segments.name]
    if manifest.state == "sealed" and not programs:
        yield f"no program draws the picture {segments.name}"
    pieces = manifest.subvolumes.programs if manifest.subvolumes else ()
    for program in (*programs, *(each for each in pieces if each.transfer == segments.name)):
        wanted = _in_pieces if program in pieces else _in_levels
        yield from (f"program {program.name} {problem}" for problem in _program(manifest, segments, program))
        yield from (f"program {program.name} {problem}" for problem in wanted(manifest, segments, program))


def label_bytes_of_pieces(manifest: Manifest) -> int:
    """Return how many bytes of a label texels of sub-volumes hold: none unless a program draws segments from them."""
    segments, pieces = manifest.segments, manifest.subvolumes.programs if manifest.subvolumes else ()
    if segments is None or all(each.transfer != segments.name for each in pieces):
        return 0
    return 1 + segments.wide


def _names(manifest: Manifest, segments: Segments) -> Iterator[str]:
    known = {function.name for function in manifest.transfer_functions}
    if segments.name in known:
        yield f"{segments.name} names a transfer function and the picture of segments"
    if len(manifest.channels) > 1 or manifest.together is not None:
        yield "segments belong to a scan of one channel"
    named = [segment.name for segment in segments.segments]
    yield from (f"segment {name} is named {count} times" for name, count in Counter(named).items() if count > 1)
    styles = [label.transfer for label in segments.labels]
    if tuple(name for name, _ in groupby(styles)) != segments.transfers or not known >= set(styles):
        yield "the labels are not in the order of the transfer functions of segments"
    by_name = {segment.name: segment for segment in segments.segments}
    for number, label in enumerate(segments.labels):
        unknown = [name for name in label.segments if name not in by_name]
        if unknown or len(set(label.segments)) < len(label.segments):
            yield f"label {number} is of segments {', '.join(label.segments)}, which are not there, or not once"
        elif label.segments and by_name[label.segments[0]].transfer != label.transfer:
            yield f"label {number} has another transfer function than its first segment"
    yield from (
        f"segment {each.name} has the transfer function {each.transfer}, which there is not"
        for each in segments.segments
        if each.transfer not in known
    )


def _texture(manifest: Manifest, segments: Segments, texture: Texture) -> Iterator[str]:
    if texture.filter != "nearest" or texture.gl.type != "UNSIGNED_BYTE":
        yield f"holds {texture.role}, but has a filter, or no bytes"
    if texture.role == "looks":
        shape = (1, *table_shape(len(segments.labels)))
        if texture.shape_zyx != shape or texture.gl.format != "RGBA" or texture.level is not None:
            yield f"is not the table of the looks of {len(segments.labels)} labels"
        if texture.transfer != segments.name:
            yield f"holds the looks of {texture.transfer}, which is not the picture of segments"
        return
    if texture.role == "label-sets":
        yield from _label_sets(manifest, segments, texture)
        return
    level = next((each for each in manifest.levels if each.index == texture.level), None)
    if level is None or not _has_shape(texture, level.grid.shape_zyx):
        yield "holds labels, but neither as a 3D texture nor as a mosaic of the shape of its level"
    if COMPONENTS.get(texture.gl.format) != 1 + segments.wide:
        yield f"holds {len(segments.labels)} labels in texels of {texture.gl.format}"


def _label_sets(manifest: Manifest, segments: Segments, texture: Texture) -> Iterator[str]:
    tables = manifest.skipping.tables if manifest.skipping else ()
    table = next((each for each in tables if (each.transfer, each.level) == (segments.name, texture.level)), None)
    if table is None:
        yield "holds the labels of blocks of a level without a skip table of segments"
    elif texture.shape_zyx != (1, *sets_shape(math.prod(table.blocks_zyx))) or texture.gl.target != "TEXTURE_2D":
        yield "has not the shape of the labels of the blocks of its level"
    if COMPONENTS.get(texture.gl.format) != 2:
        yield f"holds numbers of 16 bits in texels of {texture.gl.format}"
    if texture.transfer != segments.name:
        yield f"holds the labels of blocks of {texture.transfer}, which is not the picture of segments"
    sharing = [each for each in manifest.textures if (each.role, each.level) == (texture.role, texture.level)]
    if len(sharing) > 1:
        yield "holds the labels of blocks of a level, as another texture does"


def _has_shape(texture: Texture, shape_zyx: tuple[int, int, int]) -> bool:
    mosaic = texture.mosaic
    if mosaic is None:
        return texture.gl.target == "TEXTURE_3D" and texture.shape_zyx == shape_zyx
    held = (mosaic.slices, *mosaic.tile_shape_yx)
    return texture.gl.target == "TEXTURE_2D" and held == shape_zyx and mosaic.slices_per_texel == 1


def _program(manifest: Manifest, segments: Segments, program: Program) -> Iterator[str]:
    if program.compositing not in COMPOSITED:
        yield f"draws segments with {program.compositing}"
    if program.lighting != "none" and program.normals_from == "volume":
        yield "lights segments with the normals of values, which know no labels"
    named = [sampler.transfer for sampler in program.samplers if sampler.role == "transfer"]
    if _tables(segments, program) and named != list(segments.transfers):
        yield f"samples tables of {', '.join(map(str, named))}, and draws {', '.join(segments.transfers)}"
    if len(program.samplers) > manifest.profile.texture_units:
        yield f"reads {len(program.samplers)} textures; the profile has {manifest.profile.texture_units} units"


def _in_levels(manifest: Manifest, segments: Segments, program: Program) -> Iterator[str]:
    if program.sampling not in SAMPLED:
        yield f"draws segments from {program.sampling}"
    if not program.levels:
        yield "draws no level"
        return
    level = min(program.levels)
    held = Counter(texture.role for texture in manifest.textures if texture.level == level)
    wanted = {role: held[role] for role in ("volume", "labels", "bricks")}
    yield from _samples(program, {**wanted, "looks": 1, "transfer": _tables(segments, program)})
    labelled = {texture.level for texture in manifest.textures if texture.role == "labels"}
    yield from (f"draws level {each}, which has no labels" for each in program.levels if each not in labelled)


def _in_pieces(_manifest: Manifest, segments: Segments, program: Program) -> Iterator[str]:
    if program.sampling != "subvolumes":
        yield f"draws pieces with segments from {program.sampling}"
    yield from _samples(program, {"subvolume": PIECES, "looks": 1, "transfer": _tables(segments, program)})


def _samples(program: Program, wanted: dict[str, int]) -> Iterator[str]:
    roles = Counter(sampler.role for sampler in program.samplers if sampler.role != "skip")
    if roles != +Counter(wanted):
        yield f"draws segments, but samples {', '.join(each.role for each in program.samplers)}"


def _tables(segments: Segments, program: Program) -> int:
    """Return how many tables of transfer functions a program samples."""
    return len(segments.transfers) if program.classification == "lookup" else 0
