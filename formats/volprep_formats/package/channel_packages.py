"""A package seen channel by channel: each view is a package of one channel over the same grid."""

from volprep_formats.package.channels import channel_view, channel_views
from volprep_formats.package.reader import Package


def channel_packages(package: Package) -> dict[str, Package]:
    """Return the package as it is for each channel, under its name, the default one first."""
    return {name: package.seen_as(view, name) for name, view in channel_views(package.manifest).items()}


def package_of_transfer(package: Package, transfer: str | None) -> Package:
    """Return the package as it is for the channel of a transfer function, the default one if None.

    A name that no channel knows gives the package itself, and so does None where channels are drawn together,
    or a scan with its segments.
    """
    if transfer is None and (package.manifest.together is not None or package.manifest.segments is not None):
        return package
    functions = package.manifest.transfer_functions
    name = functions[0].name if transfer is None and functions else transfer
    for channel in package.manifest.channels:
        if name in channel.transfers:
            return package.seen_as(channel_view(package.manifest, channel), channel.name)
    return package
