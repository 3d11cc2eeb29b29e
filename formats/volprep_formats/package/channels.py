"""A package of several channels, seen channel by channel: each is a package of one channel over the same grid."""

from typing import TYPE_CHECKING

from volprep_formats.package.manifest import Channel, Manifest
from volprep_formats.package.parts.skip.record import Skipping

if TYPE_CHECKING:
    from volprep_formats.package.reader import Package


def channel_views(manifest: Manifest) -> dict[str, Manifest]:
    """Return what the manifest says of each channel, under its name; of the only one under ""."""
    if manifest.channels is None:
        return {"": manifest}
    return {channel.name: _view(manifest, channel) for channel in manifest.channels}


def channel_packages(package: "Package") -> dict[str, "Package"]:
    """Return the package as it is for each channel, the default one first; of the only one under ""."""
    if package.manifest.channels is None:
        return {"": package}
    return {name: package.seen_as(view, name) for name, view in channel_views(package.manifest).items()}


def package_of_transfer(package: "Package", transfer: str | None) -> "Package":
    """Return the package as it is for the channel of a transfer function, the default one if None.

    A name that no channel knows gives the package itself, and so does None where channels are drawn together.
    """
    if transfer is None and package.manifest.together is not None:
        return package
    functions = package.manifest.transfer_functions
    name = functions[0].name if transfer is None and functions else transfer
    for channel in package.manifest.channels or ():
        if name in channel.transfers:
            return package.seen_as(_view(package.manifest, channel), channel.name)
    return package


def _view(manifest: Manifest, channel: Channel) -> Manifest:
    transfers = set(channel.transfers)
    textures = tuple(
        texture
        for texture in manifest.textures
        if (channel.name in (texture.channels or ()) if texture.transfer is None else texture.transfer in transfers)
    )
    skipping = manifest.skipping
    if skipping is not None:
        names = {texture.name for texture in textures}
        tables = tuple(table for table in skipping.tables if table.transfer in transfers)
        ranges = tuple(each for each in skipping.ranges if each.texture in names)
        skipping = Skipping(epsilon=skipping.epsilon, tables=tables, ranges=ranges)
    proxy = manifest.proxy
    if proxy is not None:
        meshes = tuple(mesh for mesh in proxy.meshes if mesh.transfer in transfers)
        programs = tuple(program for program in proxy.programs if program.transfer in transfers)
        proxy = proxy.model_copy(update={"meshes": meshes, "programs": programs})
    editing = manifest.editing
    if editing is not None:
        own = (each for each in editing.histograms if each.channel == channel.name)
        histograms = tuple(each.model_copy(update={"channel": None}) for each in own)
        editing = editing.model_copy(update={"histograms": histograms})
    return manifest.model_copy(
        update={
            "source": channel.source,
            "statistics": channel.statistics,
            "stored_type": channel.stored_type,
            "quantization": channel.quantization,
            "channels": None,
            "together": None,
            "textures": textures,
            "levels": channel.levels,
            "transfer_functions": tuple(each for each in manifest.transfer_functions if each.name in transfers),
            "palettes": tuple(palette for palette in manifest.palettes if palette.transfer in transfers),
            "programs": tuple(program for program in manifest.programs if program.transfer in transfers),
            "skipping": skipping,
            "editing": editing,
            "proxy": proxy,
        }
    )
