"""Textures that a composed program reads for a level."""

from volprep_formats.package.manifest import Manifest
from volprep_formats.package.picture import ON_DEMAND
from volprep_formats.package.program import ComposedProgram, Sampler
from volprep_formats.package.texture import Texture

_FILLED = {"subvolume": "subvolume-{}", **{role: role for role in ON_DEMAND}}
"""Names of textures that a reader fills, by role, for the part of a sampler."""


def sampled_textures(manifest: Manifest, composed: ComposedProgram, level: int) -> tuple[str, ...]:
    """Return the names of the textures of a program's samplers, in their order; fewer if one is not there once.

    Light is that of the whole volume. A piece of sub-volumes is called `subvolume-` and its number; the textures of
    bricks on demand have the names of their roles.
    """
    return tuple(name for sampler in composed.inputs for name in _sampled(manifest, sampler, composed.picture, level))


def _sampled(manifest: Manifest, sampler: Sampler, picture: str, level: int) -> list[str]:
    filled = _FILLED.get(sampler.role)
    if filled is not None:
        return [filled.format(sampler.part)]
    transfer = sampler.transfer or picture
    # Of several channels each has its own.
    channel = next((channel.name for channel in manifest.channels if transfer in channel.transfers), None)
    found = [texture for texture in manifest.textures if _serves(texture, sampler, transfer, channel, level)]
    # A level's own table replaces the common one.
    own = [texture for texture in found if texture.level == level] or found
    return [texture.name for texture in own] if len(own) == 1 else []


def _serves(texture: Texture, sampler: Sampler, transfer: str, channel: str | None, level: int) -> bool:
    return (
        (texture.role, texture.part) == (sampler.role, sampler.part)
        and texture.level in {None, level}
        and texture.transfer in {None, transfer}
        and not texture.is_of_a_cut
        and (channel is None or not texture.channels or channel in texture.channels)
    )
