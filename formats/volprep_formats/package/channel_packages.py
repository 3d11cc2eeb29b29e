"""A package seen channel by channel: each view is a package of one channel over the same grid."""

from volprep_formats.package.channels import channel_view, channel_views
from volprep_formats.package.reader import Package


def channel_packages(package: Package) -> dict[str, Package]:
    """Return the package as it is for each channel, under its name, the default one first."""
    return {name: package.seen_as(view, name) for name, view in channel_views(package.manifest).items()}


def package_of_transfer(package: Package, transfer: str | None) -> Package:
    """Return the package as it is for the channel of a transfer function, that of the default picture if None.

    The name of a picture of several media gives the package with the grid of this picture.
    """
    manifest = package.manifest
    named = [picture.name for picture in manifest.pictures] + [
        function.name for function in manifest.transfer_functions
    ]
    name = named[0] if transfer is None and named else transfer
    for channel in package.manifest.channels:
        if name in channel.transfers:
            return package.seen_as(channel_view(package.manifest, channel), channel.name)
    picture = manifest.picture(name)
    if picture is None or picture.grid is None:
        return package
    # A channel without a grid of its own has that of the package.
    named_grids = tuple(shown.model_copy(update={"grid": shown.grid or manifest.grid}) for shown in manifest.pictures)
    seen = manifest.model_copy(update={"grid": picture.grid, "pictures": named_grids})
    return package.seen_as(seen, package.channel)
