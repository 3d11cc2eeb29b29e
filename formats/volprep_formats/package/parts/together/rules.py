"""Whether a picture of several channels agrees with the channels, and with the programs that draw it."""

from collections import Counter
from collections.abc import Iterator

from volprep_formats.package.manifest import Manifest
from volprep_formats.package.program import Program

LIGHT = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0))
"""Light of the four channels of a colour volume. The last one is extinction, and the others do not absorb."""


def together_contradictions(manifest: Manifest) -> Iterator[str]:
    """Return every problem of programs that draw no single transfer function."""
    channels = manifest.channels
    of_transfer = {name: channel.name for channel in channels for name in channel.transfers}
    known = {function.name for function in manifest.transfer_functions}
    wanted = manifest.together
    for program in manifest.programs:
        pictures = {each.name for each in (wanted, manifest.segments) if each is not None}
        if program.transfer not in known | pictures:
            yield f"program {program.name} draws {program.transfer}, which is no transfer function and no picture"
    if wanted is None:
        return
    if wanted.name in known:
        yield f"{wanted.name} names a transfer function and a picture of several"
    drawn = [of_transfer.get(name) for name in wanted.transfers]
    if None in drawn or len(set(drawn)) < len(drawn):
        yield f"the picture {wanted.name} draws {', '.join(wanted.transfers)}, which are not of one channel each"
        return
    programs = [program for program in manifest.programs if program.transfer == wanted.name]
    if manifest.state == "sealed" and not programs:
        yield f"no program draws the picture {wanted.name}"
    for program in programs:
        yield from (f"program {program.name} {problem}" for problem in _program(manifest, program, of_transfer))


def _program(manifest: Manifest, program: Program, of_transfer: dict[str, str]) -> Iterator[str]:
    transfers = manifest.together.transfers if manifest.together else ()
    levels = {channel.name: {level.index for level in channel.levels} for channel in manifest.channels}
    for name in transfers:
        missing = set(program.levels) - levels[of_transfer[name]]
        yield from (f"draws level {level}, which channel {of_transfer[name]} has not" for level in sorted(missing))
    tables = Counter(each.transfer for each in program.samplers if each.role == "transfer")
    if program.classification == "lookup" and tables != Counter(transfers):
        yield f"samples tables of {', '.join(sorted(map(str, tables)))}, and draws {', '.join(transfers)}"
    named = {of_transfer.get(each.transfer or "") for each in program.samplers if each.role == "volume"}
    volumes = [set(texture.channels) for texture in manifest.textures if texture.role == "volume"]
    sampled = set[str]().union(*(held for held in volumes if held & named))
    unread = sorted({of_transfer[name] for name in transfers} - sampled)
    yield from (f"samples no volume of channel {name}" for name in unread)
    if program.classification == "colour":
        yield from _colour(manifest, volumes)
    elif program.classification not in {"lookup", "palette", "control-points"} or program.lighting != "none":
        yield f"classifies {program.classification} and lights {program.lighting}, which several channels cannot"
    names = [each.name for each in program.uniforms] + [each.name for each in program.samplers]
    names += [each.sampler for each in program.passes]
    yield from (f"has {count} uniforms {name}" for name, count in Counter(names).items() if count > 1)
    if len(program.samplers) > manifest.profile.texture_units:
        yield f"reads {len(program.samplers)} textures; the profile has {manifest.profile.texture_units} units"


def _colour(manifest: Manifest, volumes: list[set[str]]) -> Iterator[str]:
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
    if any(len(held) != len(LIGHT) for held in volumes):
        yield "draws colours, but channels do not share texels"
