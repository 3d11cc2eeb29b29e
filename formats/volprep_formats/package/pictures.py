"""Pictures of a package, from the programs, textures and tables that its stages made: the one place that joins them."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from volprep_formats.grid import box_from_box
from volprep_formats.package.channel import Level
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.parts.costs.count import cost_of_textures
from volprep_formats.package.parts.fidelity.record import LevelFidelity
from volprep_formats.package.parts.mipmaps.texels import texture_from_box
from volprep_formats.package.picture import (
    OF_MEDIUM,
    AtMesh,
    Drawing,
    FrameTextures,
    FromBricks,
    Picture,
    Pieces,
    UniformValue,
)
from volprep_formats.package.program import ComposedProgram, Sampling
from volprep_formats.package.sampled import sampled_textures
from volprep_formats.package.texture import Texture


def with_drawings(
    manifest: Manifest,
    composed: Sequence[ComposedProgram],
    fidelity: Sequence[LevelFidelity],
    previews: Collection[tuple[str, int]],
    later_frames: Sequence[FrameTextures] = (),
) -> tuple[Picture, ...]:
    """Return the pictures of a manifest with all drawings that its programs and textures make.

    `previews` are levels that are for previews only, each with its channel.
    """
    of_later = {name for frame in later_frames for name in frame.instead.values()}
    first = tuple(texture for texture in manifest.textures if texture.name not in of_later)
    made = _Made(manifest.model_copy(update={"textures": first}), composed, fidelity, previews)
    pictures = []
    for picture in manifest.pictures:
        drawings = tuple(made.drawings(picture))
        later = (frame.drawing(number, drawing) for number, frame in enumerate(later_frames, 1) for drawing in drawings)
        found = {
            "drawings": (*drawings, *later),
            "pieces": made.pieces(picture.name),
            "on_demand": made.from_bricks(picture.name),
        }
        pictures.append(picture.model_copy(update=found))
    return tuple(pictures)


@dataclass(frozen=True)
class _Made:
    """Output of the stages."""

    manifest: Manifest
    composed: Sequence[ComposedProgram]
    fidelity: Sequence[LevelFidelity]
    previews: Collection[tuple[str, int]]

    def _programs(self, name: str) -> list[ComposedProgram]:
        return [program for program in self.composed if program.picture == name]

    def drawings(self, picture: Picture) -> Iterator[Drawing]:
        """Yield the drawings of a picture, the finest level first. Of several programs for a level the first counts."""
        name = picture.name
        by_level = {
            level: made
            for made in reversed(self._programs(name))
            for level in made.levels
            if made.program.rays == "box" and made.program.sampling not in {"subvolumes", "on-demand"}
        }
        for level, composed in sorted(by_level.items()):
            textures = sampled_textures(self.manifest, composed, level)
            if len(textures) == len(composed.inputs):
                yield self._drawing(picture, level, textures, composed)
        slices = [texture for texture in self.manifest.textures if (texture.role, texture.transfer) == ("slices", name)]
        for level in sorted({texture.level or 0 for texture in slices}):
            names = tuple(texture.name for texture in slices if (texture.level or 0) == level)
            yield self._drawing(picture, level, names, None)

    def _drawing(
        self, picture: Picture, level: int, names: tuple[str, ...], composed: ComposedProgram | None
    ) -> Drawing:
        name = picture.name
        textures = [texture for texture in self.manifest.textures if texture.name in names]
        meshes = self.manifest.proxy.meshes if self.manifest.proxy is not None else ()
        own = [mesh for mesh in meshes if (mesh.transfer, mesh.level) == (name, level)]
        at_mesh = (
            program.program.name
            for program in self._programs(name)
            if program.program.rays == "mesh" and level in program.levels
        )
        return Drawing(
            level=level,
            program=composed.program.name if composed is not None else None,
            textures=names,
            values=tuple(self._values(picture, level, textures)) if composed is not None else (),
            step_mm=composed.rays.step_of(level) if composed is not None else None,
            at_mesh=next((AtMesh(program=name, mesh=mesh.name) for mesh in own for name in at_mesh), None),
            preview_only=any((medium.channel, level) in self.previews for medium in picture.media) or None,
            cost=cost_of_textures(self.manifest, textures, own),
            fidelity=next(
                (
                    fidelity.as_record
                    for fidelity in self.fidelity
                    if (fidelity.transfer, fidelity.level) == (name, level)
                ),
                None,
            ),
        )

    def _values(self, picture: Picture, level: int, textures: Sequence[Texture]) -> Iterator[UniformValue]:
        drawn = [_level(self.manifest, medium.channel, level) for medium in picture.media]
        if picture.mixing == "one" or picture.grid is None:
            yield from _drawing_values(self.manifest, drawn[0], textures)
            return
        for number, medium in enumerate(picture.media):
            own = [texture for texture in textures if medium.channel in texture.channels]
            yield from _medium_values(self.manifest, picture, number, drawn[number], own)

    def pieces(self, name: str) -> Pieces | None:
        """Return the drawing of sub-volumes, with the tables of level 0."""
        return next((Pieces(**found) for found in self._of_level_0(name, "subvolumes")), None)

    def from_bricks(self, name: str) -> FromBricks | None:
        """Return the drawing of bricks on demand, with the tables of level 0."""
        return next((FromBricks(**found) for found in self._of_level_0(name, "on-demand")), None)

    def _of_level_0(self, name: str, sampling: Sampling) -> Iterator[dict[str, Any]]:
        for composed in self._programs(name):
            textures = sampled_textures(self.manifest, composed, 0)
            if composed.program.sampling == sampling and len(textures) == len(composed.inputs):
                yield {"program": composed.program.name, "textures": textures, "step_mm": composed.rays.step_of(0)}


def _medium_values(
    manifest: Manifest, picture: Picture, number: int, drawn: Level, textures: Sequence[Texture]
) -> Iterator[UniformValue]:
    """Yield how the box of a picture maps to the box of one of its media, that to its texels, and its opacity."""
    medium, grid = picture.media[number], manifest.grid_of(picture.media[number].channel)
    if grid is None or picture.grid is None:
        return
    rows = (*box_from_box(grid, medium.affine, picture.grid), (0.0, 0.0, 0.0, 1.0))
    place, texels, opacity = OF_MEDIUM[number]
    yield UniformValue(source=place, numbers=tuple(row[column] for column in range(4) for row in rows))
    yield UniformValue(source=texels, numbers=texture_from_box(drawn, textures))
    yield UniformValue(source=opacity, numbers=(1.0,))


def _level(manifest: Manifest, channel: str, index: int) -> Level:
    """Return a level of a channel."""
    levels = next(each.levels for each in manifest.channels if each.name == channel)
    return next(level for level in levels if level.index == index)


def _drawing_values(manifest: Manifest, drawn: Level, textures: Sequence[Texture]) -> Iterator[UniformValue]:
    """Yield the uniforms of a drawing that are the same in every view: how the box maps to texels and blocks."""
    yield UniformValue(source="texture_from_box", numbers=texture_from_box(drawn, textures))
    mipmap = next((texture.mipmap for texture in textures if texture.mipmap is not None), None)
    if mipmap is not None:
        yield UniformValue(source="mipmap", numbers=(float(mipmap),))
    names = {texture.name for texture in textures}
    for table in manifest.skipping.tables if manifest.skipping is not None else ():
        if table.texture in names:
            yield UniformValue(source="blocks_from_box", numbers=table.blocks_from_box(drawn.grid))
