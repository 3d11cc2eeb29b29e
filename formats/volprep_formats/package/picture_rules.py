"""Whether pictures and their drawings agree with the channels, programs, textures and levels of a manifest."""

from collections import Counter
from collections.abc import Iterator, Mapping

import numpy as np

from volprep_formats.package.manifest import Manifest
from volprep_formats.package.picture import PIECES, Drawing, Picture, Pieces
from volprep_formats.package.pictures import drawing_values
from volprep_formats.package.program import Program
from volprep_formats.package.texture import SAMPLED_ROLES, Texture

_RELATIVE_TOLERANCE = 1e-9


def picture_contradictions(manifest: Manifest) -> Iterator[str]:
    """Return every problem of pictures, one sentence each."""
    names = Counter(picture.name for picture in manifest.pictures)
    yield from (f"picture {name} is there {count} times" for name, count in names.items() if count > 1)
    if manifest.state == "sealed":
        drawn = {medium.transfer for picture in manifest.pictures for medium in picture.media}
        yield from (
            f"no picture shows the transfer function {function.name}"
            for function in manifest.transfer_functions
            if function.name not in drawn
        )
    for picture in manifest.pictures:
        yield from (f"picture {picture.name} {problem}" for problem in _picture(manifest, picture))


def _picture(manifest: Manifest, picture: Picture) -> Iterator[str]:
    channels = {transfer: channel for channel in manifest.channels for transfer in channel.transfers}
    known = [medium for medium in picture.media if medium.transfer in channels]
    if any(medium not in known or channels[medium.transfer].name != medium.channel for medium in picture.media):
        yield "shows a transfer function that its channel does not have"
        return
    if (len(picture.media) > 1) != (picture.mixing != "one") and picture.mixing != "labels":
        yield f"mixes {len(picture.media)} media as {picture.mixing}"
    levels = {level.index: level for level in channels[picture.media[0].transfer].levels}
    indices = [drawing.level for drawing in picture.drawings]
    if indices != sorted(set(indices)) or not set(indices) <= levels.keys():
        yield f"draws levels {indices}, which are not levels of its channel in their order"
        return
    programs = {program.name: program for program in manifest.programs}
    textures = {texture.name: texture for texture in manifest.textures}
    for drawing in picture.drawings:
        is_of_slices = drawing.program is None and not manifest.profile.has_shaders
        found = _slices(picture, drawing, textures) if is_of_slices else _drawing(picture, drawing, programs, textures)
        yield from (f"at level {drawing.level} {problem}" for problem in found)
        yield from (f"at level {drawing.level} {problem}" for problem in _values(manifest, drawing, textures))
    if picture.pieces is not None:
        yield from (f"in pieces {problem}" for problem in _pieces(picture, picture.pieces, programs, textures))


def _slices(picture: Picture, drawing: Drawing, textures: Mapping[str, Texture]) -> Iterator[str]:
    of_picture = [
        each.name
        for each in textures.values()
        if (each.role, each.transfer, each.level or 0) == ("slices", picture.name, drawing.level)
    ]
    if sorted(of_picture) != sorted(drawing.textures):
        yield "does not name the stacks of slices of its transfer function"


def _drawing(
    picture: Picture, drawing: Drawing, programs: Mapping[str, Program], textures: Mapping[str, Texture]
) -> Iterator[str]:
    if drawing.step_mm is None:
        yield "takes samples at no distance"
    named = {drawing.program or "": "box"} | ({drawing.at_mesh.program: "mesh"} if drawing.at_mesh is not None else {})
    for name, rays in named.items():
        program = programs.get(name)
        if program is None or program.rays != rays or program.sampling == "subvolumes":
            yield f"names the program {name}, which does not draw it"
        elif len(drawing.textures) != len(program.samplers):
            yield f"names {len(drawing.textures)} textures for {len(program.samplers)} samplers"
    for name in drawing.textures:
        if name not in textures or not _is_of(picture, drawing.level, textures[name]):
            yield f"names the texture {name}, which is not of it"


def _pieces(
    picture: Picture, pieces: Pieces, programs: Mapping[str, Program], textures: Mapping[str, Texture]
) -> Iterator[str]:
    program = programs.get(pieces.program)
    if program is None or program.sampling != "subvolumes":
        yield f"names the program {pieces.program}, which does not draw it"
    elif len(pieces.textures) != len(program.samplers):
        yield f"names {len(pieces.textures)} textures for {len(program.samplers)} samplers"
    for name in pieces.textures:
        if name not in PIECES and (name not in textures or not _is_of(picture, 0, textures[name])):
            yield f"names the texture {name}, which is not of it"


def _is_of(picture: Picture, level: int, texture: Texture) -> bool:
    """Return whether a drawing of a picture at a level may read a texture."""
    return (
        texture.role in SAMPLED_ROLES
        and texture.level in {None, level}
        and texture.transfer in {None, picture.name, *(medium.transfer for medium in picture.media)}
        and not texture.is_of_a_cut
        and (not texture.channels or not {medium.channel for medium in picture.media}.isdisjoint(texture.channels))
    )


def _values(manifest: Manifest, drawing: Drawing, textures: Mapping[str, Texture]) -> Iterator[str]:
    """Check the values of uniforms against the grid of the level, the mipmap and the skip table."""
    own = [textures[name] for name in drawing.textures if name in textures]
    expected = [*drawing_values(manifest, drawing.level, own)] if drawing.program is not None else []
    if [value.source for value in drawing.values] != [value.source for value in expected]:
        names = ", ".join(value.source for value in expected)
        yield f"has values for {', '.join(value.source for value in drawing.values)} instead of {names}"
        return
    for value, wanted in zip(drawing.values, expected, strict=True):
        is_same = len(value.numbers) == len(wanted.numbers) and np.allclose(
            value.numbers, wanted.numbers, rtol=_RELATIVE_TOLERANCE, atol=0.0
        )
        if not is_same:
            yield f"has {value.source} that does not follow from its level"
