"""Whether the channels of a manifest agree with each other, and with the textures that hold them."""

from collections import Counter
from collections.abc import Iterator

from volprep_formats.package.manifest import Manifest
from volprep_formats.textures.block_formats import block_of
from volprep_formats.textures.texel_formats import COMPONENTS


def channel_contradictions(manifest: Manifest) -> Iterator[str]:
    """Return every problem between the channels of a manifest; each for itself is another matter."""
    channels = manifest.channels
    yield from (
        f"channel {name} is named {count} times"
        for name, count in Counter(channel.name for channel in channels).items()
        if count > 1
    )
    for channel in channels:
        window = None if channel.quantization is None else channel.quantization.window
        if window is not None and window[0] >= window[1]:
            yield f"channel {channel.name} has an empty window"
    for channel in channels[1:]:
        if channel.source.info.grid != channels[0].source.info.grid:
            yield f"channel {channel.name} has another grid than channel {channels[0].name}"
    stored = {channel.name: channel.stored_type for channel in channels}
    known = stored.keys()
    for texture in manifest.textures:
        own = texture.channels
        listed = ", ".join(own) or "none"
        if bool(own) == (texture.transfer is not None) or not known >= set(own) or len(set(own)) < len(own):
            yield f"texture {texture.name} is of channels {listed} and transfer function {texture.transfer}"
        elif len({stored[name] for name in own}) > 1 or (len(own) > 1 and texture.role != "volume"):
            yield f"texture {texture.name} cannot hold channels {listed} together"
        elif len(own) > 1 and _components(texture.format) != len(own):
            yield f"texture {texture.name} holds channels {listed} in texels of {texture.format}"


def _components(name: str) -> int | None:
    """Return the components of a voxel that texels of this format hold."""
    block = block_of(name)
    return COMPONENTS.get(name) if block is None else block.components if block.is_srgb else 1
