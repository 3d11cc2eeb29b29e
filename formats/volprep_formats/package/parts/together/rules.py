"""Whether a picture of several channels agrees with the channels."""

from collections.abc import Iterator

from volprep_formats.package.manifest import Manifest

LIGHT = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0))
"""Light of the four channels of a colour volume. The last one is extinction, and the others do not absorb."""


def together_contradictions(manifest: Manifest) -> Iterator[str]:
    """Return every problem of the picture of several channels."""
    channels = manifest.channels
    of_transfer = {name: channel.name for channel in channels for name in channel.transfers}
    known = {function.name for function in manifest.transfer_functions}
    wanted = manifest.together
    if wanted is None:
        return
    if wanted.name in known:
        yield f"{wanted.name} names a transfer function and a picture of several"
    drawn = [of_transfer.get(name) for name in wanted.transfers]
    if None in drawn or len(set(drawn)) < len(drawn):
        yield f"the picture {wanted.name} draws {', '.join(wanted.transfers)}, which are not of one channel each"
        return
    picture = manifest.picture(wanted.name)
    if picture is None:
        if manifest.state == "sealed":
            yield f"no program draws the picture {wanted.name}"
    elif tuple(medium.transfer for medium in picture.media) != wanted.transfers:
        yield f"the picture {wanted.name} has other media than transfer functions"
    elif picture.mixing == "colour":
        yield from (f"picture {wanted.name} {problem}" for problem in _colour(manifest))


def _colour(manifest: Manifest) -> Iterator[str]:
    """Return the problems of channels that hold light and extinction."""
    of_transfer = {name: channel for channel in manifest.channels for name in channel.transfers}
    transfers = manifest.together.transfers if manifest.together else ()
    functions = {function.name: function for function in manifest.transfer_functions}
    largest = functions[transfers[-1]].points[-1].extinction_per_mm
    lines = [[(0.0, light, 0.0), (1.0, light, largest)] for light in LIGHT]
    found = [[(p.value, p.colour, p.extinction_per_mm) for p in functions[name].points] for name in transfers]
    if found != lines or not largest > 0.0:
        yield "draws colours, but its functions are not light of red, green and blue, and extinction"
    windows = {each.quantization.window for name in transfers if (each := of_transfer[name]).quantization is not None}
    if windows != {(0.0, 1.0)}:
        yield "draws colours, but the values of a channel do not go from 0 to 1"
    if any(len(texture.channels) != len(LIGHT) for texture in manifest.textures if texture.role == "volume"):
        yield "draws colours, but channels do not share texels"
