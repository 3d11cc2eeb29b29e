"""Whether the channels of a manifest agree with each other, and with what it says of its source."""

from collections import Counter
from collections.abc import Iterator

from volprep_formats.package.manifest import Manifest
from volprep_formats.package.texture import CHANNELS


def channel_contradictions(manifest: Manifest) -> Iterator[str]:
    """Return every problem between the channels of a manifest that has some; each for itself is another matter."""
    channels = manifest.channels or ()
    yield from (
        f"channel {name} is named {count} times"
        for name, count in Counter(channel.name for channel in channels).items()
        if count > 1
    )
    first = channels[0]
    for field in ("source", "statistics", "stored_type", "quantization"):
        if getattr(manifest, field) != getattr(first, field):
            yield f"{field} is not that of the first channel, {first.name}"
    for channel in channels:
        if channel.source.info.grid != first.source.info.grid:
            yield f"channel {channel.name} has another grid than channel {first.name}"
    indices = {level.index for level in manifest.levels}
    held = {level.index for channel in channels for level in channel.levels}
    if indices != held:
        yield f"it has levels {sorted(indices)}, its channels {sorted(held)}"
    functions = Counter(name for channel in channels for name in channel.transfers)
    yield from (f"{count} channels have the transfer function {name}" for name, count in functions.items() if count > 1)
    if manifest.transfer_functions:
        named = {transfer.name for transfer in manifest.transfer_functions}
        yield from (f"transfer function {name} is of no channel" for name in sorted(named - functions.keys()))
        yield from (f"transfer function {name} of a channel is missing" for name in sorted(functions.keys() - named))
    stored = {channel.name: channel.stored_type for channel in channels}
    known = stored.keys()
    for texture in manifest.textures:
        own = texture.channels or ()
        listed = ", ".join(own) or "none"
        if bool(own) == (texture.transfer is not None) or not known >= set(own) or len(set(own)) < len(own):
            yield f"texture {texture.name} is of channels {listed} and transfer function {texture.transfer}"
        elif len({stored[name] for name in own}) > 1 or (len(own) > 1 and texture.role != "volume"):
            yield f"texture {texture.name} cannot hold channels {listed} together"
        elif len(own) > 1 and CHANNELS.get(texture.gl.format) != len(own):
            yield f"texture {texture.name} holds channels {listed} in texels of {texture.gl.format}"
