"""Whether what a manifest says of normals agrees with itself; SPEC.md states the rules."""

from collections.abc import Iterator

from volprep_formats.package.manifest import Manifest, Texture
from volprep_formats.package.normals import NormalCode

_CHANNELS: dict[NormalCode, int] = {"biased8": 3, "snorm8": 3, "oct8": 2, "oct12": 3}
_CHANNELS_OF_FORMAT = {"RG": 2, "LUMINANCE_ALPHA": 2, "RGB": 3, "RGBA": 4}


def normals_contradictions(manifest: Manifest) -> Iterator[str]:
    """Give every problem of normals that can be seen without opening another file."""
    levels = {level.index: level for level in manifest.levels}
    held = [texture.level for texture in manifest.textures if texture.role == "normals"]
    if len(held) != len(set(held)):
        yield "two textures hold the normals of one level"
    for texture in manifest.textures:
        if texture.role != "normals":
            if texture.normals is not None:
                yield f"texture {texture.name} has the role {texture.role}, but says what its normals mean"
            continue
        yield from (f"texture {texture.name} {problem}" for problem in _code(texture))
        level = levels.get(-1 if texture.level is None else texture.level)
        if level is None:
            yield f"texture {texture.name} holds normals of level {texture.level}, which is not among the levels"
        elif texture.gl.target != "TEXTURE_3D" or texture.shape_zyx != level.grid.shape_zyx:
            yield f"texture {texture.name} holds normals, so it must be 3D and have the shape {level.grid.shape_zyx}"
    for program in manifest.programs:
        samples = any(sampler.role == "normals" for sampler in program.samplers)
        if samples != (program.lighting != "none"):
            yield f"program {program.name} has lighting {program.lighting}, and {'' if samples else 'no '}normals"
        if samples and not set(program.levels) <= set(held):
            yield f"program {program.name} reads normals, which not all of its levels have"


def _code(texture: Texture) -> Iterator[str]:
    normals = texture.normals
    if normals is None:
        yield "holds normals, but does not say what they mean"
        return
    channels = _CHANNELS[normals.code] + (normals.largest_gradient is not None)
    if _CHANNELS_OF_FORMAT.get(texture.gl.format) != channels:
        yield f"holds normals of {channels} channels, its format is {texture.gl.format}"
    if (normals.code == "snorm8") != (texture.gl.type == "BYTE"):
        yield f"holds normals of code {normals.code}, but texels of type {texture.gl.type}"
    if (texture.filter == "nearest") != (normals.code in {"oct8", "oct12"}):
        yield f"holds normals of code {normals.code}, but has the filter {texture.filter}"
    if texture.transfer is not None or texture.mosaic is not None:
        yield "holds normals, but has a transfer function or a mosaic"
