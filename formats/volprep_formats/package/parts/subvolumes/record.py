"""subvolumes/grid.json: level 0 in pieces that a device can hold, and how to walk from piece to piece.

The grid of sub-volumes, its numbered points and the walk along the direction of view come from the Beaver Volume
Renderer (Schultz and Bailey, 7.3). There the pieces share nothing, and the picture has a seam at each border; here
neighbours share one layer of voxels, so that every position lies between voxels of one piece.
"""

import json
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, ValidationError

from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import LONGEST_AXIS, Count, Index
from volprep_formats.package.parts.segments.record import LARGEST_LABEL
from volprep_formats.package.texture import MosaicLayout, SampleFilter
from volprep_formats.package.values import PackagePath
from volprep_formats.record import Record, problems
from volprep_formats.textures.mosaic import own_slices, slices_of_mosaic, tiles_of
from volprep_formats.textures.texel_formats import COMPONENTS, Dimension, TextureFormat
from volprep_formats.untrusted_json import read_record

Cuts = tuple[Index, ...]
Span = tuple[int, int]
Move = Literal["-x", "+x", "-y", "+y", "-z", "+z"]
PointKind = Literal["corner", "edge", "column edge", "plane", "interior"]
Degrees = Annotated[float, Field(ge=0.0, le=180.0)]
Pixels = Annotated[float, Field(gt=0.0)]


def spans_of(cuts: Cuts, ghost: int) -> tuple[Span, ...]:
    """Return the first and the last voxel of each piece along an axis, with `ghost` layers where the volume goes on."""
    return tuple((max(low - ghost, 0), min(high + ghost, cuts[-1])) for low, high in pairwise(cuts))


class Subvolume(Record):
    """One piece of level 0."""

    minimum: Index
    """Smallest code."""
    maximum: Index
    """Largest code."""
    file: PackagePath | None = None
    """KTX 2 file of a 3D texture, or of a mosaic. Absent for an empty piece; draw a constant piece of the code
    `minimum` instead."""
    label: Annotated[int, Field(ge=0, le=LARGEST_LABEL)] | None = None
    """Label of all voxels of an empty piece, if pieces hold labels; absent for label 0."""


class GridPoint(Record):
    """A point where up to eight pieces meet. The device holds the pieces around one point at a time."""

    kind: PointKind
    """Number of axes along which the point is outermost. Three: corner. Two: edge, or column edge if only y varies.
    One: plane. None: interior."""
    subvolumes: tuple[Index, ...]
    """Numbers of the pieces that touch it, ascending."""
    moves: tuple[Move, ...]
    """Directions along the index axes that lead to another point."""


class ViewThresholds(Record):
    """Which way "forward" leads: the direction of view (x, y, z), along the index axes, becomes up to three moves.

    theta = acos(z), phi = atan2(y, x), in degrees. Between moves along one and along two axes lie the directions
    22.5° from an axis. And when another level is drawn: by the size of its voxels, the shortest side, in pixels.
    """

    plus_z_below_theta: Degrees = 67.5
    """The move is +z if theta is below this."""
    minus_z_above_theta: Degrees = 112.5
    """The move is -z if theta is above this."""
    sideways_between_theta: tuple[Degrees, Degrees] = (22.5, 157.5)
    """There are moves along x and y only if theta lies between these."""
    plus_x_below_phi: Degrees = 67.5
    """The move is +x if the absolute value of phi is below this."""
    minus_x_above_phi: Degrees = 112.5
    """The move is -x if the absolute value of phi is above this."""
    y_between_phi: tuple[Degrees, Degrees] = (22.5, 157.5)
    """The move is +y or -y, by the sign of phi, if the absolute value of phi lies between these."""
    finer_above_pixels: Pixels = 2.0
    """The next finer level is drawn if a voxel of the level is larger than this number of pixels. Level 0 is the
    pieces."""
    coarser_below_pixels: Pixels = 0.75
    """The next coarser level is drawn if a voxel of the level is smaller than this number of pixels. It is less than
    half of the other number, so that a small change of the zoom does not switch back and forth between levels."""


class SubvolumeGrid(Record):
    """The pieces of level 0, x first, then y, then z, and the points between them in the same order."""

    format: Literal["volpkg-subvolumes"] = "volpkg-subvolumes"
    """Marks the file."""
    shape_zyx: tuple[Count, Count, Count]
    """Number of voxels of level 0 along each axis."""
    size: Annotated[int, Field(ge=2, le=LONGEST_AXIS)]
    """Largest number of voxels of a piece along an axis, shared and ghost ones included."""
    cuts_zyx: tuple[Cuts, Cuts, Cuts]
    """For each axis: the voxels where the level is cut, from 0 to the last voxel. Piece i holds the voxels cuts[i] to
    cuts[i + 1], both included, so neighbours share one layer."""
    ghost: Annotated[int, Field(ge=1, le=1)] | None = None
    """Layers of voxels that a piece holds beyond its cuts, on each side where the volume goes on: for the differences
    that light a sample. Absent for none."""
    texture_format: TextureFormat
    """Format of a texel of a piece. Texels of two or three components hold a value and a label: one byte, or two with
    the low one first."""
    dimension: Dimension
    """Dimension of the texture of a piece."""
    filter: SampleFilter = "linear"
    """Texture filter of a piece: nearest if voxels are labels."""
    mosaic: MosaicLayout | None = None
    """Layout of a piece in a 2D texture, where devices have no 3D textures: one for all pieces. Voxel (x, y, z) of a
    piece is texel (x, y) of slice z. Tiles and slices beyond a smaller piece repeat its last voxels."""
    whole: PackagePath | None = None
    """KTX 2 file of the whole level. Any box can be read from it by seeking."""
    subvolumes: tuple[Subvolume, ...]
    """The pieces. Number i + nx · (j + ny · k) is piece i along x, j along y, k along z."""
    points: tuple[GridPoint, ...]
    """The points, one more than pieces along each axis, x first, then y, then z. Point i along an axis lies on voxel
    cuts[i]."""
    view: ViewThresholds
    """Conversion of the direction of view to a move."""

    @property
    def counts_zyx(self) -> tuple[int, int, int]:
        """Number of pieces along each axis."""
        z, y, x = (len(cuts) - 1 for cuts in self.cuts_zyx)
        return z, y, x

    @property
    def spans_zyx(self) -> tuple[tuple[Span, ...], tuple[Span, ...], tuple[Span, ...]]:
        """First and last voxel of the pieces along each axis."""
        z, y, x = (spans_of(cuts, self.ghost or 0) for cuts in self.cuts_zyx)
        return z, y, x

    def piece_shape_zyx(self, number: int) -> tuple[int, int, int]:
        """Return the number of voxels of a piece along each axis; neighbours share a layer."""
        places = np.unravel_index(number, self.counts_zyx)
        z, y, x = (spans[at][1] - spans[at][0] + 1 for at, spans in zip(places, self.spans_zyx, strict=True))
        return z, y, x

    @property
    def largest_piece_zyx(self) -> tuple[int, int, int]:
        """Return the number of voxels along each axis that no piece exceeds."""
        z, y, x = (max(last - first for first, last in spans) + 1 for spans in self.spans_zyx)
        return z, y, x

    def texture_shape_zyx(self, number: int) -> tuple[int, int, int]:
        """Return the depth, height and width of the texture of a piece, in texels."""
        return self.piece_shape_zyx(number) if self.mosaic is None else (1, *self.mosaic.texture_shape_yx)

    def voxels_of_mosaic(self, number: int, texels: NDArray[np.generic]) -> NDArray[np.generic]:
        """Take the voxels of a piece out of the texels [y, x] or [y, x, component] of its mosaic.

        [z, y, x], or with labels [z, y, x, component].
        """
        assert self.mosaic is not None  # noqa: S101 - asked for mosaics only
        z, y, x = self.piece_shape_zyx(number)
        return slices_of_mosaic([texels], self.mosaic)[:z, :y, :x]


def constant_piece(code: int, texel: TextureFormat, shape_zyx: tuple[int, int, int]) -> NDArray[np.generic]:
    """Return the voxels of a piece without a file: one code, in the format of the other pieces."""
    if texel == "r16float":
        return np.full(shape_zyx, code / 65535, np.float16)
    return np.full(shape_zyx, code, np.uint16 if texel == "r16unorm" else np.uint8)


def label_bytes(texel: TextureFormat) -> int:
    """Return how many bytes of a label texels hold behind the value: 0 if pieces have no labels."""
    return {2: 1, 3: 2}.get(COMPONENTS.get(texel, 1), 0)


def constant_texture(piece: Subvolume | None, texel: TextureFormat) -> NDArray[np.generic]:
    """Return the only texel of the texture of a piece without a file, [1, 1, 1] or [1, 1, 1, component].

    It is 0 for a piece that does not exist.
    """
    code, label = (0, 0) if piece is None else (piece.minimum, piece.label or 0)
    components = COMPONENTS.get(texel, 1)
    value = constant_piece(code, texel, (1, 1, 1))
    if components == 1:
        return value
    texels = np.repeat(value[..., None], components, axis=-1)
    for component in range(1, 1 + label_bytes(texel)):
        texels[..., component] = label >> 8 * (component - 1) & 0xFF
    return texels


def encode_grid(grid: SubvolumeGrid) -> bytes:
    """UTF-8 JSON: keys sorted, no spaces, absent fields left out. Always the same bytes for the same grid."""
    record = grid.model_dump(mode="json", exclude_none=True)
    text = json.dumps(record, ensure_ascii=False, allow_nan=False, separators=(",", ":"), sort_keys=True)
    return (text + "\n").encode("utf-8")


def decode_grid(data: bytes, package: Path, name: str, *, strict: bool = False) -> SubvolumeGrid:
    """Read the file `name` of `package`; `strict` also refuses unknown keys.

    Raises VP4011 for anything but a grid, and for one that contradicts itself.
    """
    try:
        grid = read_record(SubvolumeGrid, data, "forbid" if strict else "ignore")
    except ValidationError as error:
        raise VolprepError("VP4011", path=package, problem=f"{name}: {problems(error)}") from error
    except ValueError as error:
        raise VolprepError("VP4011", path=package, problem=f"{name} is not JSON: {error}") from error
    for problem in _problems(grid):
        raise VolprepError("VP4011", path=package, problem=f"{name}: {problem}")
    return grid


def _problems(grid: SubvolumeGrid) -> list[str]:
    found = []
    for axis, n, cuts, spans in zip("zyx", grid.shape_zyx, grid.cuts_zyx, grid.spans_zyx, strict=True):
        # One voxel along an axis is one piece from 0 to 0.
        in_order = all(before < after for before, after in pairwise(cuts)) or (n == 1 and cuts == (0, 0))
        in_size = all(last - first < grid.size for first, last in spans)
        if len(cuts) < 2 or cuts[0] != 0 or cuts[-1] != n - 1 or not (in_order and in_size):
            found.append(f"the cuts along {axis} do not lead from 0 to {n - 1} in steps below {grid.size}")
    nz, ny, nx = grid.counts_zyx
    counted = (("sub-volumes", grid.subvolumes, nz * ny * nx), ("points", grid.points, (nz + 1) * (ny + 1) * (nx + 1)))
    for name, listed, count in counted:
        if len(listed) != count:
            found.append(f"it has {len(listed)} {name} instead of {count}")
    if any(number >= len(grid.subvolumes) for point in grid.points for number in point.subvolumes):
        found.append("a point names a sub-volume that is not there")
    if (grid.mosaic is None) != (grid.dimension == "3d"):
        found.append(f"its pieces are {grid.dimension}, {'without' if grid.mosaic is None else 'with'} a mosaic")
    # A mosaic is compared with pieces, which wrong cuts may not make.
    return found if found or grid.mosaic is None else _mosaic_problems(grid, grid.mosaic)


def _mosaic_problems(grid: SubvolumeGrid, mosaic: MosaicLayout) -> list[str]:
    """Return why a mosaic does not hold every piece. Overlapping slices need a tile that begins with the last one."""
    depth, *sides = grid.largest_piece_zyx
    tiles = tiles_of(mosaic.slices, mosaic.slices_per_texel, mosaic.order)
    rows, columns = mosaic.tiles_y * mosaic.pitch_yx[0], mosaic.tiles_x * mosaic.pitch_yx[1]
    wrong = {
        "lies in several textures": mosaic.textures != 1,
        f"has {mosaic.components_per_voxel} components in a voxel": mosaic.components_per_voxel
        != 1 + label_bytes(grid.texture_format),
        f"has {mosaic.slices_per_texel} slices in a texel of {grid.texture_format}": mosaic.slices_per_texel
        * mosaic.components_per_voxel
        != COMPONENTS.get(grid.texture_format),
        f"has one slice in a texel, but these are {mosaic.order}": mosaic.slices_per_texel == 1
        and mosaic.order != "interleaved",
        f"has tiles of {mosaic.tile_shape_yx} for pieces of {(sides[0], sides[1])}": any(
            tile < side for tile, side in zip(mosaic.tile_shape_yx, sides, strict=True)
        ),
        f"has no room for {depth} slices": mosaic.slices < depth
        or tiles > mosaic.tiles_x * mosaic.tiles_y
        or tiles * own_slices(mosaic) < depth,
        f"has tiles that do not fit into {mosaic.texture_shape_yx}": rows > mosaic.texture_shape_yx[0]
        or columns > mosaic.texture_shape_yx[1],
    }
    return [f"its mosaic {problem}" for problem, is_wrong in wrong.items() if is_wrong]
