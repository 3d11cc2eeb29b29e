"""Whether the segments of a manifest agree with its textures, programs and transfer functions."""

import math
from collections import Counter
from collections.abc import Iterator
from itertools import groupby

from volprep_formats.package.manifest import Manifest
from volprep_formats.package.parts.segments.label_sets import sets_shape
from volprep_formats.package.parts.segments.record import Segments, table_shape
from volprep_formats.package.texture import Texture
from volprep_formats.textures.texel_formats import COMPONENTS, has_bytes


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
    picture = manifest.picture(segments.name)
    if manifest.state == "sealed" and picture is None:
        yield f"no program draws the picture {segments.name}"


def label_bytes_of_pieces(manifest: Manifest) -> int:
    """Return how many bytes of a label texels of sub-volumes hold: none unless a program draws segments from them."""
    segments = manifest.segments
    picture = None if segments is None else manifest.picture(segments.name)
    return 0 if segments is None or picture is None or picture.pieces is None else 1 + segments.wide


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
    if texture.filter != "nearest" or not has_bytes(texture.format):
        yield f"holds {texture.role}, but has a filter, or no bytes"
    if texture.role == "looks":
        shape = (1, *table_shape(len(segments.labels)))
        if texture.shape_zyx != shape or COMPONENTS.get(texture.format) != 4 or texture.level is not None:
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
    if COMPONENTS.get(texture.format) != 1 + segments.wide:
        yield f"holds {len(segments.labels)} labels in texels of {texture.format}"


def _label_sets(manifest: Manifest, segments: Segments, texture: Texture) -> Iterator[str]:
    tables = manifest.skipping.tables if manifest.skipping else ()
    table = next((each for each in tables if (each.transfer, each.level) == (segments.name, texture.level)), None)
    if table is None:
        yield "holds the labels of blocks of a level without a skip table of segments"
    elif texture.shape_zyx != (1, *sets_shape(math.prod(table.blocks_zyx))) or texture.dimension != "2d":
        yield "has not the shape of the labels of the blocks of its level"
    if COMPONENTS.get(texture.format) != 2:
        yield f"holds numbers of 16 bits in texels of {texture.format}"
    if texture.transfer != segments.name:
        yield f"holds the labels of blocks of {texture.transfer}, which is not the picture of segments"
    sharing = [each for each in manifest.textures if (each.role, each.level) == (texture.role, texture.level)]
    if len(sharing) > 1:
        yield "holds the labels of blocks of a level, as another texture does"


def _has_shape(texture: Texture, shape_zyx: tuple[int, int, int]) -> bool:
    mosaic = texture.mosaic
    if mosaic is None:
        return texture.dimension == "3d" and texture.shape_zyx == shape_zyx
    held = (mosaic.slices, *mosaic.tile_shape_yx)
    return texture.dimension == "2d" and held == shape_zyx and mosaic.slices_per_texel == 1
