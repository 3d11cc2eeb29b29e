"""Check the consistency of a manifest's precomputed light; SPEC.md states the rules."""

from collections import Counter
from collections.abc import Iterator

import numpy as np

from volprep_formats.package.manifest import Manifest
from volprep_formats.package.program import Program
from volprep_formats.package.texture import Texture

ROLE = "light"
"""Role of its textures and samplers."""
_TEXEL_TOLERANCE = 1e-9


def light_contradictions(manifest: Manifest) -> Iterator[str]:
    """Return every problem of textures of light, and of the programs that read them."""
    held = [texture for texture in manifest.textures if texture.role == ROLE]
    count = Counter(texture.transfer for texture in held)
    known = {function.name for function in manifest.transfer_functions}
    for texture in manifest.textures:
        yield from (f"texture {texture.name} {problem}" for problem in _texture(texture, manifest))
    for texture in held:
        if texture.transfer not in known:
            yield f"texture {texture.name} holds light of {texture.transfer}, which is no transfer function"
        elif count[texture.transfer] > 1:
            yield f"{count[texture.transfer]} textures hold the light of {texture.transfer}"
    for program in manifest.programs:
        yield from (f"program {program.name} {problem}" for problem in _program(program, count))


def _texture(texture: Texture, manifest: Manifest) -> Iterator[str]:
    light = texture.light
    if (texture.role == ROLE) != (light is not None):
        yield f"has the role {texture.role}, {'but a record of light' if light else 'but no record of its light'}"
        return
    if light is None:
        return
    if texture.gl.target != "TEXTURE_3D" or texture.gl.format != "RG" or texture.mosaic is not None:
        yield "holds light, so it must be a 3D texture of two components"
    if texture.filter != "linear" or texture.level is not None:
        yield "holds light, so its filter must be linear and it must be for all levels"
    low, high = light.stored_values
    if not low < high:
        yield f"has the stored values {low} and {high}, which must ascend"
    if manifest.grid is None:
        return
    reach = np.array(light.texture_from_box_per_mm_xyz) * np.array(manifest.grid.extent_mm_zyx[::-1])
    texels = np.array(texture.shape_zyx[::-1])
    # The texture ends with the box, or less than one texel behind it.
    if not np.all((reach <= 1.0 + _TEXEL_TOLERANCE) & (reach > 1.0 - 1.0 / texels - _TEXEL_TOLERANCE)):
        yield f"covers {(1 / reach).tolist()} times the box, which does not follow from its texels"


def _program(program: Program, count: Counter[str | None]) -> Iterator[str]:
    samplers = sum(sampler.role == ROLE for sampler in program.samplers)
    if samplers != int(program.baked):
        yield f"samples {samplers} textures of light, and {'is' if program.baked else 'is not'} lit by one"
    elif program.baked and count[program.transfer] != 1:
        yield f"is lit by light of {program.transfer}, which {count[program.transfer]} textures hold"
