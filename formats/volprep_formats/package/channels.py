"""A manifest seen channel by channel: each view is that of a package of one channel, over the grid of the channel."""

from volprep_formats.package.channel import Channel
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.parts.editing.record import Editing
from volprep_formats.package.parts.proxy.record import Proxy
from volprep_formats.package.parts.skip.record import Skipping


def channel_views(manifest: Manifest) -> dict[str, Manifest]:
    """Return the manifest of each channel, by channel name."""
    return {channel.name: channel_view(manifest, channel) for channel in manifest.channels}


def channel_view(manifest: Manifest, channel: Channel) -> Manifest:
    """Return the manifest of one channel."""
    own = tuple(
        picture for picture in manifest.pictures if picture.mixing == "one" and picture.media[0].channel == channel.name
    )
    grid = manifest.grid_of(channel.name)
    shared = [picture for picture in manifest.pictures if picture not in own]
    others = {name for other in manifest.channels if other.name != channel.name for name in other.transfers}
    others |= {picture.name for picture in shared}
    programs = {name for picture in shared for name in picture.programs}.difference(
        *(picture.programs for picture in own)
    )
    textures = tuple(
        texture
        for texture in manifest.textures
        if (channel.name in texture.channels if texture.channels else texture.transfer not in others)
    )
    skipping = manifest.skipping
    if skipping is not None:
        names = {texture.name for texture in textures}
        tables = tuple(table for table in skipping.tables if table.transfer not in others)
        ranges = tuple(each for each in skipping.ranges if each.texture in names)
        skipping = Skipping(epsilon=skipping.epsilon, tables=tables, ranges=ranges)
    proxy = manifest.proxy
    if proxy is not None:
        meshes = tuple(mesh for mesh in proxy.meshes if mesh.transfer not in others)
        proxy = Proxy(epsilon=proxy.epsilon, meshes=meshes)
    editing = manifest.editing
    if editing is not None:
        editing = Editing(
            histograms=tuple(histogram for histogram in editing.histograms if histogram.channel == channel.name)
        )
    return manifest.model_copy(
        update={
            "channels": (channel,),
            "textures": textures,
            "palettes": tuple(palette for palette in manifest.palettes if palette.transfer not in others),
            "programs": tuple(program for program in manifest.programs if program.name not in programs),
            "grid": grid,
            "pictures": tuple(picture.model_copy(update={"grid": None}) for picture in own),
            "skipping": skipping,
            "editing": editing,
            "proxy": proxy,
        }
    )
