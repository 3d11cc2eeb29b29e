"""What a user should know about a package beside its numbers."""

from collections.abc import Iterator

from volprep.transfer.table import Table
from volprep_formats.package.manifest import Manifest


def remarks(manifest: Manifest) -> Iterator[str]:
    """Return the remarks of the readers, each with the name of its channel."""
    sources = (
        {"": manifest.source} if manifest.channels is None else {f"{c.name}: ": c.source for c in manifest.channels}
    )
    for name, source in sources.items():
        for remark in source.info.remarks:
            yield f"{name}{remark}"


def warnings(manifest: Manifest) -> Iterator[str]:
    """Name the transfer functions that show nothing: no value between the smallest and the largest has extinction."""
    for function in manifest.transfer_functions:
        channels = (channel for channel in manifest.channels or () if function.name in channel.transfers)
        values = next((channel.statistics for channel in channels), manifest.statistics)
        if Table.exact(function).largest_extinction(values.minimum, values.maximum) == 0.0:
            span = f"{values.minimum:g} to {values.maximum:g}"
            yield f"transfer function {function.name} shows none of the scan's values, {span}: its pictures are empty"
