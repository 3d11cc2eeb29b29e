"""Texels that an app makes when it changes the looks of segments."""

import numpy as np

from volprep.parts.mosaic.packing import pack_mosaic
from volprep.parts.skip.tables import skip_table
from volprep_formats.package.parts.segments.label_sets import shown_blocks_of
from volprep_formats.package.parts.segments.record import Segments, looks
from volprep_formats.package.parts.segments.texels import look_texels, visible_labels
from volprep_formats.package.reader import Package
from volprep_formats.package.texture import Texture
from volprep_formats.textures import ktx2


def texels_with_hidden(package: Package, level: int, *hidden: str) -> dict[str, bytes]:
    """Return the texels of the table of looks and of the skip table with some segments hidden, by texture."""
    segments = package.manifest.segments
    changed = tuple(each.model_copy(update={"visible": each.name not in hidden}) for each in segments.segments)
    segments = segments.model_copy(update={"segments": changed})
    names = {each.role: each.name for each in package.manifest.textures if each.level in {None, level}}
    table = look_table(package)
    return {
        table.name: look_texels(looks(segments), table.format).tobytes(),
        names["skip"]: skip_texels(package, segments, level).tobytes(),
    }


def look_table(package: Package) -> Texture:
    """Return the table of looks."""
    return next(each for each in package.manifest.textures if each.role == "looks")


def skip_texels(package: Package, segments: Segments, level: int) -> np.ndarray:
    """Return the texels of the skip table of a level for the looks of segments."""
    manifest = package.manifest
    textures = {each.role: each for each in manifest.textures if each.level == level}
    record = next(each for each in manifest.skipping.tables if each.level == level)
    sets = ktx2.decode(package.read_bytes(textures["label-sets"].file), "sets").data
    visible = visible_labels(looks(segments), look_table(package).format)
    shown = shown_blocks_of(sets, int(np.prod(record.blocks_zyx)), visible)
    occupied = shown.reshape(record.blocks_zyx)
    entries = skip_table(occupied, record.kind)
    layout = textures["skip"].mosaic
    if layout is None:
        return entries
    strips = list(pack_mosaic(lambda z0, z1: entries[z0:z1], layout))
    return np.concatenate(strips).reshape(textures["skip"].shape_zyx)
