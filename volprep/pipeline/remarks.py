"""What a user should know about a package beside its numbers."""

from collections.abc import Iterator

from volprep_formats.package.function_table import Table
from volprep_formats.package.manifest import Manifest


def remarks(manifest: Manifest) -> Iterator[str]:
    """Return the remarks of the readers, each with the name of its channel."""
    several = len(manifest.channels) > 1
    for channel in manifest.channels:
        for remark in channel.source.info.remarks:
            yield f"{channel.name}: {remark}" if several else remark


def warnings(manifest: Manifest) -> Iterator[str]:
    """Name the transfer functions that show nothing: no value between the smallest and the largest has extinction."""
    for channel in manifest.channels:
        low, high = channel.statistics.minimum, channel.statistics.maximum
        for function in channel.transfer_functions:
            if Table.exact(function).largest_extinction(low, high) == 0.0:
                shown = f"shows none of the scan's values, {low:g} to {high:g}"
                yield f"transfer function {function.name} {shown}: its pictures are empty"
