"""Check the editing records of a manifest against its levels and tables."""

from collections import Counter
from collections.abc import Iterator

from volprep_formats.package.manifest import Manifest


def editing_contradictions(manifest: Manifest) -> Iterator[str]:
    """Return every problem of joint histograms: their levels, and the tables of these levels."""
    if manifest.editing is None:
        return
    levels = {level.index for level in manifest.levels}
    tables = {(texture.level, texture.transfer) for texture in manifest.textures if texture.role == "transfer"}
    for level, count in Counter(each.level for each in manifest.editing.histograms).items():
        if count > 1:
            yield f"level {level} has {count} joint histograms"
        if level not in levels:
            yield f"a joint histogram is for level {level}, which is not among the levels"
    for histogram in manifest.editing.histograms:
        if histogram.channel not in {channel.name for channel in manifest.channels}:
            yield f"joint histogram {histogram.file} is of channel {histogram.channel}, which is not there"
        for function in manifest.transfer_functions:
            if (histogram.level, function.name) not in tables:
                yield f"level {histogram.level} has a joint histogram, but no table of its own for {function.name}"
    frozen = [program.name for program in manifest.programs if program.classification != "lookup"]
    yield from (f"transfer functions are editable, but program {name} has no lookup table" for name in frozen)
    if manifest.proxy is not None:
        yield "transfer functions are editable, but there are meshes around visible voxels"
