"""Pictures of a package, and their drawings: what a user chooses, and what an app draws of it at a level."""

from typing import Annotated, Literal

from pydantic import Field

from volprep_formats.grid import Affine, Count, Grid, Index, Signed, row_of
from volprep_formats.package.program import MediumSource
from volprep_formats.package.transfer_function import Fraction
from volprep_formats.package.values import ByteCount
from volprep_formats.record import Record
from volprep_formats.source import ChannelName

Mixing = Literal["one", "sum", "labels", "colour"]
"""How the media of a picture mix."""


class PictureMedium(Record):
    """One of the media of a picture: a channel, seen through a transfer function."""

    channel: ChannelName
    """Name of the channel."""
    transfer: str
    """Name of the transfer function."""
    placed: Annotated[tuple[float, ...], Field(min_length=12, max_length=12)] | None = None
    """Matrix from the space of the channel's scan to that of the package, if the two differ: a registration. Three rows
    of four numbers; the fourth row is 0, 0, 0, 1."""
    unlit: bool | None = None
    """Whether it keeps its colours in a picture whose program is lit. Absent means false."""

    @property
    def affine(self) -> Affine | None:
        """The rows of `placed`."""
        rows = self.placed
        return None if rows is None else (row_of(rows[:4]), row_of(rows[4:8]), row_of(rows[8:]))


class DrawCost(Record):
    """Bytes that a device takes for a drawing, in every view and size of picture.

    Textures that the program reads, and the mesh where rays begin at one. Pictures, depth buffers and shaders are not
    counted: they depend on the app and on the driver.
    """

    upload_bytes: ByteCount
    """Bytes of texels, vertices and indices that the app uploads to OpenGL ES."""
    gpu_bytes: ByteCount
    """Memory of the uploaded data. A texel of three bytes counts as four, and one of a palette as four: many drivers
    keep them so."""


class Fidelity(Record):
    """Error of a drawing against the integral of the scan, in views from all sides.

    Pictures hold the whole volume. A pixel is the mean of at least four rays.
    """

    pixels: Count
    """Width and height of the pictures."""
    pixels_per_voxel: Annotated[float, Field(gt=0.0)]
    """Pixels along the shortest edge of a voxel of the level, in the middle of the picture."""
    views: Count
    """Number of views."""
    rmse: Fraction
    """Root mean square error over all pixels of all views and the four channels, premultiplied linear light. Over other
    views from all sides it is the same within 20 %."""
    maximum: Fraction
    """No channel of a pixel, in any view from any side, is expected to be further off: the mean of the largest errors
    of the views and nine standard deviations, at least twice the mean, at most 1."""
    flip: Fraction
    """FLIP, the perceived difference: mean over all pixels that are not transparent and over the views, sRGB, over
    black or over white, whichever is larger, at 67 pixels per degree."""


OF_MEDIUM: tuple[tuple[MediumSource, MediumSource, MediumSource], ...] = (
    ("medium_0_from_box", "texture_from_medium_0", "opacity_of_medium_0"),
    ("medium_1_from_box", "texture_from_medium_1", "opacity_of_medium_1"),
    ("medium_2_from_box", "texture_from_medium_2", "opacity_of_medium_2"),
    ("medium_3_from_box", "texture_from_medium_3", "opacity_of_medium_3"),
)
"""Of each medium: the matrix from the box of the picture to its own box, the factors from there to its texels, and the
factor of its extinction."""


class UniformValue(Record):
    """The value of a uniform that is the same in every view of a drawing."""

    source: Literal["texture_from_box", "mipmap", "blocks_from_box", MediumSource]
    """Source that uniforms of this value name."""
    numbers: Annotated[tuple[float, ...], Field(min_length=1, max_length=16)]
    """One number for f32, three for vec3f, 16 for mat4x4f, column by column."""


class AtMesh(Record):
    """A program that draws the picture of a drawing from the same textures, with rays that begin and end at a mesh."""

    program: str
    """Name of the program."""
    mesh: str
    """Name of the mesh."""


PIECES: tuple[str, ...] = tuple(f"subvolume-{number}" for number in range(8))
"""Names of the sub-volumes around a point among the textures of a program."""


class Pieces(Record):
    """A picture of the sub-volumes around a point of their grid."""

    program: str
    """Name of the program."""
    textures: tuple[str, ...]
    """Names of textures: one for each sampler of the program, in their order. `subvolume-0` to `subvolume-7` are the
    sub-volumes around the point: plus 1 for the upper one along x, plus 2 along y, plus 4 along z."""
    step_mm: Annotated[float, Field(gt=0.0)]
    """Nominal distance of the samples along a ray."""


ON_DEMAND: tuple[str, ...] = ("brick-pool", "brick-pages")
"""Names of the pool of bricks on demand and of its page table among the textures of a program."""


class FromBricks(Record):
    """A picture of the bricks on demand that a device holds."""

    program: str
    """Name of the program."""
    textures: tuple[str, ...]
    """Names of textures: one for each sampler of the program, in their order. `brick-pool` and `brick-pages` are the
    two that a reader fills."""
    step_mm: Annotated[float, Field(gt=0.0)]
    """Nominal distance of the samples along a ray."""


MOST_FRAMES = 1024
"""Frames of a series at most."""


class SeriesFrame(Record):
    """A frame of a time series."""

    time_s: float | None = None
    """Time in seconds, on the clock of the scan; absent if it is not known."""


class Drawing(Record):
    """A picture at a level, of a frame. An app binds its textures to the samplers of its program, and draws."""

    level: Signed
    """Number of the level."""
    frame: Index | None = None
    """Number of the frame in `frames` of the manifest; absent means 0."""
    program: str | None = None
    """Name of the program; absent on OpenGL ES 1.1, which draws the slices of `textures`."""
    textures: tuple[str, ...]
    """Names of textures: one for each sampler of the program, in their order; or all stacks of slices."""
    values: tuple[UniformValue, ...]
    """Values of those uniforms that are the same in every view, whether or not the program has them."""
    step_mm: Annotated[float, Field(gt=0.0)] | None = None
    """Nominal distance of the samples along a ray; absent where slices are drawn."""
    at_mesh: AtMesh | None = None
    """The same picture with rays that begin and end at a mesh, if the package has one for it."""
    preview_only: bool | None = None
    """Whether it is for previews only: it may be beyond the tolerance even at one voxel per pixel. An app draws it
    while finer levels load and while the camera moves, and settles on a finer one if the device can hold it. Absent
    means false. Never true for the finest drawing."""
    cost: DrawCost
    """Bytes that it takes."""
    fidelity: Fidelity | None = None
    """Its fidelity to the scan; absent unless the scene requests it."""

    @property
    def programs(self) -> frozenset[str]:
        """Names of the programs that draw it: its own, and the one whose rays begin at a mesh."""
        at_mesh = None if self.at_mesh is None else self.at_mesh.program
        return frozenset(name for name in (self.program, at_mesh) if name is not None)


class FrameTextures(Record):
    """The textures of a frame that the first frame does not have."""

    instead: dict[str, str]
    """Name of its texture, by the name of the one of the first frame."""

    def drawing(self, frame: int, first: Drawing) -> Drawing:
        """Return the drawing of this frame that corresponds to one of the first frame."""
        textures = tuple(self.instead.get(name, name) for name in first.textures)
        return first.model_copy(update={"frame": frame, "textures": textures})


class Picture(Record):
    """A choice of the user: media, and how they are drawn."""

    name: str
    """Name, unique in the package."""
    media: Annotated[tuple[PictureMedium, ...], Field(min_length=1)]
    """Media that it shows, each with another transfer function."""
    mixing: Mixing = "one"
    """How its media mix. one: there is one medium. sum: extinctions add, and each medium emits light as its extinction
    does. labels: the label of a voxel says which medium it is. colour: the media are premultiplied red, green and blue
    light, and extinction."""
    grid: Grid | None = None
    """Grid in whose box it is drawn, if that is not the `grid` of the manifest: that of its channel, or one around all
    media whose channels lie on several grids."""
    drawings: tuple[Drawing, ...] = ()
    """One for each frame and each level that can be drawn, frame by frame, finest first; in a draft none before its
    programs are made."""
    pieces: Pieces | None = None
    """Level 0 drawn from its sub-volumes, if the package has them."""
    on_demand: FromBricks | None = None
    """Drawn from bricks on demand, if the package has them."""

    @property
    def programs(self) -> frozenset[str]:
        """Names of the programs that draw it."""
        named = {name for drawing in self.drawings for name in drawing.programs}
        return frozenset(named | {part.program for part in (self.pieces, self.on_demand) if part is not None})
