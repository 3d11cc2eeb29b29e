"""Textures that a program reads for a level, by the samplers of SPEC.md."""

from volprep_formats.package.manifest import Manifest
from volprep_formats.package.program import Program
from volprep_formats.package.texture import Texture


def sampled_textures(manifest: Manifest, program: Program, level: int) -> list[Texture | None]:
    """Return the texture of each sampler of a program, in their order; None where there is not exactly one.

    Light is that of the whole volume.
    """
    found: list[Texture | None] = []
    for sampler in program.samplers:
        transfer = sampler.transfer or program.transfer
        # Of several channels each has its own.
        channel = next((each.name for each in manifest.channels if transfer in each.transfers), None)
        matches = [
            texture
            for texture in manifest.textures
            if (texture.role, texture.part) == (sampler.role, sampler.part)
            and texture.level in {None, level}
            and texture.transfer in {None, transfer}
            and not texture.is_of_a_cut
            and (channel is None or not texture.channels or channel in texture.channels)
        ]
        # A level's own table replaces the common one.
        matches = [texture for texture in matches if texture.level == level] or matches
        found.append(matches[0] if len(matches) == 1 else None)
    return found
