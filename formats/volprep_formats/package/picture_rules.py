"""Whether the programs, textures and meshes that pictures name exist."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import product

from volprep_formats.package.manifest import Manifest
from volprep_formats.package.picture import ON_DEMAND, PIECES, FromBricks, Picture, Pieces
from volprep_formats.package.program import Program


def picture_contradictions(manifest: Manifest) -> Iterator[str]:
    """Return every problem of pictures that have drawings, one sentence each."""
    for picture in (picture for picture in manifest.pictures if picture.drawings):
        yield from (f"picture {picture.name} {problem}" for problem in _picture(manifest, picture))


def _picture(manifest: Manifest, picture: Picture) -> Iterator[str]:
    channels = {transfer: channel for channel in manifest.channels for transfer in channel.transfers}
    for medium in picture.media:
        if medium.transfer not in channels or channels[medium.transfer].name != medium.channel:
            yield f"shows {medium.transfer}, which is no transfer function of {medium.channel}"
            return
    levels = {level.index for level in channels[picture.media[0].transfer].levels}
    indices = [drawing.level for drawing in picture.drawings if not drawing.frame]
    if indices != sorted(set(indices)) or not set(indices) <= levels:
        yield f"draws levels {indices}, which are not levels of its channel in their order"
        return
    frames = range(len(manifest.frames or (None,)))
    if [(drawing.frame or 0, drawing.level) for drawing in picture.drawings] != [*product(frames, indices)]:
        yield f"does not draw the levels {indices} of each of {len(frames)} frames in their order"
        return
    programs = {program.name: program for program in manifest.programs}
    textures = {texture.name for texture in manifest.textures}
    meshes = {mesh.name for mesh in manifest.proxy.meshes} if manifest.proxy is not None else set()
    for drawing in picture.drawings:
        found = [f"names the texture {name}, which is not there" for name in drawing.textures if name not in textures]
        if manifest.profile.has_shaders:
            found += _read(programs, drawing.program or "", drawing.textures)
            if drawing.step_mm is None:
                found.append("takes samples at no distance")
        if drawing.at_mesh is not None:
            found += _read(programs, drawing.at_mesh.program, drawing.textures)
            if drawing.at_mesh.mesh not in meshes:
                found.append(f"begins at the mesh {drawing.at_mesh.mesh}, which is not there")
        yield from (f"at level {drawing.level} {problem}" for problem in found)
    for key, missing, drawn, own in _beside(manifest, picture):
        if missing is not None:
            yield missing
        unknown = [name for name in drawn.textures if name not in own and name not in textures]
        yield from (f"in {key} names the texture {name}, which is not there" for name in unknown)
        yield from (f"in {key} {problem}" for problem in _read(programs, drawn.program, drawn.textures))


Names = Sequence[str]


def _beside(manifest: Manifest, picture: Picture) -> Iterator[tuple[str, str | None, Pieces | FromBricks, Names]]:
    """Yield how a picture is drawn beside its levels: its key, what the package lacks, and names of its textures."""
    if picture.pieces is not None:
        missing = None if manifest.subvolumes else "has pieces, and the package has no sub-volumes"
        yield "pieces", missing, picture.pieces, PIECES
    if picture.on_demand is not None:
        missing = None if manifest.on_demand else "is drawn on demand, and the package has no bricks"
        yield "on_demand", missing, picture.on_demand, ON_DEMAND


def _read(programs: Mapping[str, Program], name: str, textures: Sequence[str]) -> Iterator[str]:
    program = programs.get(name)
    if program is None:
        yield f"names the program {name}, which is not there"
    elif len(textures) != len(program.samplers):
        yield f"names {len(textures)} textures for {len(program.samplers)} samplers"
