"""Remarks about a package for its user, besides its numbers."""

from collections.abc import Iterator

from volprep.plan.item_kinds import (
    BAKED_LIGHT,
    BEYOND,
    FIRST_LOOK,
    LEVEL,
    LIT_CODES,
    SEGMENT_LIGHT,
    SEGMENT_NAMES,
    SEGMENT_REMARK,
)
from volprep.scene.presets import load_preset
from volprep_formats.package.function_table import Table
from volprep_formats.package.manifest import Manifest

_AIR_BELOW_HU = -200.0
"""Air is -1000 HU; fat, the lightest tissue, above -150."""
_TRANSPARENT = (
    "no voxel absorbs light: alpha, or the number of the extinction, is 0 everywhere, and pictures are empty; --rgb "
    "luminance draws the volume in grey, without its alpha"
)


def remarks(manifest: Manifest) -> Iterator[str]:
    """Return what a scan without a scene was recognised as, and the remarks of the readers with their channels.

    Also names of segments that are left out, remarks about the source of segments, levels where they lose light, baked
    light that is left out or beyond the tolerance, and presets that a user chose for other values.
    """
    yield from (item.reason for item in manifest.plan if item.kind == FIRST_LOOK)
    yield from (item.reason for item in manifest.plan if item.kind == SEGMENT_NAMES and not item.kept)
    yield from (item.reason for item in manifest.plan if item.kind == SEGMENT_REMARK)
    yield from (item.reason for item in manifest.plan if item.kind == SEGMENT_LIGHT and not item.kept)
    yield from (item.reason for item in manifest.plan if item.kind == BAKED_LIGHT)
    if all(item.kind != FIRST_LOOK for item in manifest.plan):
        yield from _without_hounsfield_units(manifest)
    # The channels of a volume in colour are made of one source.
    several = len(manifest.channels) > 1 and all(program.classification != "colour" for program in manifest.programs)
    for channel in manifest.channels:
        for remark in channel.source.info.remarks:
            yield f"{channel.name}: {remark}" if several else remark


def warnings(manifest: Manifest) -> Iterator[str]:
    """Return what a user should act on.

    Empty functions, full resolution left out, codes too coarse for light, and other parts of the error that are beyond
    the tolerance.
    """
    yield from _missing_resolution(manifest)
    yield from (item.reason for item in manifest.plan if item.kind in {LIT_CODES, BEYOND})
    if any(program.classification == "colour" for program in manifest.programs):
        if manifest.channels[-1].statistics.maximum == 0.0:
            yield _TRANSPARENT
        return
    for channel in manifest.channels:
        low, high = channel.statistics.minimum, channel.statistics.maximum
        for function in channel.transfer_functions:
            if Table.exact(function).largest_extinction(low, high) == 0.0:
                shown = f"shows none of the scan's values, {low:g} to {high:g}"
                yield f"transfer function {function.name} {shown}: its pictures are empty"


def _without_hounsfield_units(manifest: Manifest) -> Iterator[str]:
    """Name presets of a CT, which count in Hounsfield units, that are used for a scan without such values."""
    for channel in manifest.channels:
        statistics = channel.statistics
        if channel.source.info.unit == "HU" or statistics.minimum < _AIR_BELOW_HU:
            continue
        presets = {item.transfer: item.reason.partition(":")[0] for item in manifest.plan if item.kind == "preset"}
        for function in channel.transfer_functions:
            preset = presets.get(function.name)
            if preset is not None and load_preset(preset).in_hounsfield_units:
                values = f"{statistics.minimum:g} to {statistics.maximum:g}"
                yield (
                    f"preset {preset} is for Hounsfield units, and the scan's values, {values}, hold no air of a CT; "
                    "volprep presets lists others"
                )


def _missing_resolution(manifest: Manifest) -> Iterator[str]:
    """Say that no level has the voxels of the scan, why, and what would keep them."""
    channel = manifest.channels[0]
    if not channel.levels:  # a draft
        return
    finest = channel.levels[0]
    if manifest.grid is None or finest.index == 0 or manifest.subvolumes or manifest.on_demand:
        return
    full, held = ("×".join(map(str, reversed(grid.shape_zyx))) for grid in (manifest.grid, finest.grid))
    why = next(
        (item for item in manifest.plan if (item.kind, item.level, item.channel) == (LEVEL, 0, channel.name)), None
    )
    reason = "" if why is None else f": {why.reason}"
    way = (
        "--on-demand keeps it, in bricks that an app fetches as its view needs them, and --grid auto in sub-volumes"
        if manifest.programs
        else "a profile with shaders may keep it"
    )
    yield f"full resolution is left out, the finest level has {held} of {full} voxels{reason}; {way}"
