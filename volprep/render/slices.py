"""Draws stacks of slices with OpenGL ES 1.1: textured polygons, blended back to front.

2D texture slicing after Moser and Weiskopf (2008, section 4). Of the stacks that the package has, the one whose axis
comes nearest to the direction of view is drawn. A slice is nine patches: filtering stays between texel centres, and
the outermost half voxel repeats the edge, so that slices whose tiles abut do not see each other.

Texels have the opacity of a path as long as the distance of slices. A ray at an angle to the axis has a path that is
1 / cos longer, and the opacity that belongs to it is 1 - (1 - opacity)^(1 / cos). The fixed-function pipeline can only
multiply: by 1 / cos, which is that for faint texels, at most √3 with three stacks of cubic voxels. It is cut where the
most opaque texel would pass 1, because colours would then be too bright, and at 2, the most that texture combiners do.

A package may ask for several polygons for each slice. Those between two slices mix both with two texture units (mobile
volume rendering thesis, section 2.2.3), which every OpenGL ES 1.1 has.
"""

import time
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import NDArray

from volprep.render.box_lines import BoxLines
from volprep.render.egl import Context, GlDriver
from volprep.render.gl1 import Gl1, Unit
from volprep.render.limits import check_textures
from volprep.render.timing import Clock, median_ms
from volprep.transfer.preclassified import code_colours, largest_opacity
from volprep.truth.stacks import brightness, facing_axis
from volprep_formats.arrays import Float32Array, Float64Array, UInt8Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.package.channel import Level
from volprep_formats.package.parts.slices.record import SliceLayout, StackAxis
from volprep_formats.package.reader import Package
from volprep_formats.package.texture import Texture
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.textures import ktx2
from volprep_formats.textures.paletted import PALETTE_BYTES
from volprep_formats.textures.texel_formats import PALETTED

_XYZ: dict[StackAxis, int] = {"x": 0, "y": 1, "z": 2}
_ACROSS: dict[StackAxis, tuple[int, int]] = {"x": (1, 2), "y": (0, 2), "z": (0, 1)}
"""Axes (xyz) of the columns and the rows of a slice."""
# Two triangles for each of nine patches of 4×4 corners.
_PATCHES = np.array(
    [[c + o for o in (0, 1, 5, 0, 5, 4)] for c in (4 * row + column for row in range(3) for column in range(3))],
    np.uint16,
).ravel()


@dataclass(frozen=True)
class _Part:
    """One texture of a stack, on the device."""

    handle: int
    centres_mm: Float64Array
    """Position of each slice along the axis."""
    layers: int
    """Polygons of each slice."""
    positions: Float32Array
    """Corners of all patches of all slices, [slice · 16, 3], box millimetres."""
    coordinates: Float32Array
    """Their texture coordinates, [slice · 16, 2]."""
    largest_opacity: float
    """No texel is more opaque."""

    def corners(self, slice_number: int) -> Float32Array:
        """Copy of the corners of the patches of a slice [16, 3]."""
        return self.positions[16 * slice_number : 16 * slice_number + 16].copy()

    def texels(self, slice_number: int) -> Float32Array:
        """Texture coordinates of the corners of a slice [16, 2]."""
        return self.coordinates[16 * slice_number : 16 * slice_number + 16]

    def triangles(self, order: NDArray[np.intp]) -> NDArray[np.uint16]:
        """Corners of the triangles of slices in this order."""
        corners: NDArray[np.uint16] = (order[:, None] * 16 + _PATCHES).astype(np.uint16)
        return np.ascontiguousarray(corners)


class SliceRenderer:
    """Draws the slices of one transfer function of a package. Use it as a context manager."""

    def __init__(
        self,
        package: Package,
        *,
        level: int | None = None,
        transfer: str | None = None,
        lengthen: bool = True,
        edit: TransferFunction | None = None,
    ) -> None:
        """Choose what to draw: the first transfer function unless another is named.

        With `lengthen`, texels count 1 / cos of the angle between axis and view. `edit` replaces the transfer function.
        Raises VP5018 if the package cannot draw that, VP5010, VP5011 and VP5014 if it breaks a limit of its profile,
        VP5023 for an edit of functions that are not editable.
        """
        manifest = package.manifest
        found = next(
            (
                (shown, drawing)
                for shown, drawing in manifest.drawings
                if transfer in {None, shown.name} and level in {None, drawing.level}
            ),
            None,
        )
        if found is None:
            held = "; ".join(f"level {drawing.level} with {shown.name}" for shown, drawing in manifest.drawings)
            fields = {"level": "any" if level is None else level, "transfer": transfer or ""}
            raise VolprepError("VP5018", package=package.path, known=held or "nothing", **fields)
        picture, drawing = found
        self.transfer = picture.name
        """Transfer function."""
        by_name = {texture.name: texture for texture in manifest.textures}
        self._textures = [by_name[name] for name in drawing.textures]
        check_textures(f"slices of {self.transfer}", self._textures, manifest.profile)
        self.level: Level = manifest.level(drawing.level)
        """The level that is drawn."""
        self._package = package
        self._palettes = {} if edit is None else self._edited(edit)
        self._lengthen = lengthen
        self._stack = ExitStack()

    def __enter__(self) -> Self:
        """Open a context and upload everything. Raises VP5001 to VP5009 if the driver cannot do it."""
        with ExitStack() as stack:
            context = stack.enter_context(Context("es1.1"))
            self._gl = Gl1(context)
            stack.callback(self._gl.close)
            self._parts: dict[StackAxis, list[_Part]] = {}
            for texture in sorted(self._textures, key=lambda texture: texture.part):
                if texture.slices is not None:
                    handle = stack.enter_context(self._gl.texture(texture, self._read(texture)))
                    part = _part(handle, texture, self._layout(texture, texture.slices), self.level.grid)
                    self._parts.setdefault(texture.slices.axis, []).append(part)
            self._target_stack = stack.enter_context(ExitStack())
            self._target: tuple[int, tuple[int, int]] | None = None
            self._stack = stack.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Release everything."""
        self._stack.__exit__(kind, error, trace)

    @property
    def driver(self) -> GlDriver:
        """The driver that draws."""
        return self._gl.driver

    @property
    def uploaded_bytes(self) -> int:
        """Bytes of textures that were handed to the driver."""
        return self._gl.uploaded_bytes

    @property
    def name(self) -> str:
        """Description of the renderer."""
        return f"slices of {self.transfer}"

    def facing(self, box_from_clip: Float64Array) -> tuple[StackAxis, float]:
        """Return the axis of the stack that is drawn, and the cosine of its angle to the direction of view.

        Of stacks at equal angles, the first of x, y, z is drawn, whatever the rounding of a camera is.
        """
        return facing_axis(box_from_clip, self._parts)

    def layers(self, axis: StackAxis) -> int:
        """Return the number of polygons of each slice of a stack."""
        return self._parts[axis][0].layers

    def factor(self, box_from_clip: Float64Array) -> float:
        """Return the factor of all texels, 1 or more."""
        axis, cosine = self.facing(box_from_clip)
        largest = max(part.largest_opacity for part in self._parts[axis])
        return brightness(cosine, largest) if self._lengthen else 1.0

    def distance_mm(self, box_from_clip: Float64Array) -> float:
        """Distance of the slices that are drawn, along the middle of the view."""
        axis, cosine = self.facing(box_from_clip)
        layers = self._parts[axis][0].layers
        return self.level.grid.spacing_mm_zyx[::-1][_XYZ[axis]] / (layers * max(cosine, 1e-6))

    def render(
        self, box_from_clip: Float64Array, shape_hw: tuple[int, int], step_mm: float | None = None
    ) -> Float32Array:
        """Draw a picture as [H, W, 4], row 0 on top, premultiplied linear RGB and opacity.

        `box_from_clip` is 4×4, from homogeneous clip coordinates to box millimetres. Raises VP5009 for an impossible
        size, VP5019 for any step: slices are as far apart as they are.
        """
        if step_mm is not None:
            raise VolprepError("VP5019", step_mm=step_mm, reason="slices are as far apart as voxels are")
        return self._gl.read(self._draw(box_from_clip, shape_hw), shape_hw)

    def render_on(
        self, box_from_clip: Float64Array, shape_hw: tuple[int, int], background: float, *, white: bool = False
    ) -> Float32Array:
        """Draw a picture as `render` does, before a grey, 0 to 1; if `white`, as if the volume were white."""
        return self._gl.read(self._draw(box_from_clip, shape_hw, background, white=white), shape_hw)

    def time_ms(
        self, box_from_clip: Float64Array, shape_hw: tuple[int, int], repeats: int = 5, clock: Clock = time.perf_counter
    ) -> float:
        """Median of the milliseconds that drawing takes, over `repeats` pictures after one that is not counted.

        `clock` returns the time in seconds.
        """
        return median_ms(lambda: self._draw(box_from_clip, shape_hw), self._gl.finish, repeats, clock=clock)

    def render_with_lines(
        self, box_from_clip: Float64Array, shape_hw: tuple[int, int], small: Float32Array, lines: Sequence[BoxLines]
    ) -> Float32Array:
        """Draw lines with all pixels, and between those behind the volume and those before it a picture with fewer.

        `small` is [h, w, 4], premultiplied.
        """
        clip_from_box = np.linalg.inv(box_from_clip).astype(np.float64)
        target = self._target_of(shape_hw)
        self._gl.clear(target, shape_hw)
        for outline in lines:
            self._gl.lines(outline.behind, outline.colour, clip_from_box)
        self._gl.picture(np.rint(np.clip(small, 0.0, 1.0) * 255).astype(np.uint8))
        for outline in lines:
            self._gl.lines(outline.before, outline.colour, clip_from_box)
        return self._gl.read(target, shape_hw)

    def _draw(
        self, box_from_clip: Float64Array, shape_hw: tuple[int, int], background: float = 0.0, *, white: bool = False
    ) -> int:
        axis, _ = self.facing(box_from_clip)
        target = self._target_of(shape_hw)
        clip_from_box = np.linalg.inv(box_from_clip).astype(np.float64)
        brightness = self.factor(box_from_clip)
        self._gl.begin(target, shape_hw, clip_from_box, brightness, background=background, white=white)
        parts = self._parts[axis]
        if parts[0].layers > 1:
            self._gl.begin_mixing(brightness, white=white)
            self._draw_between(parts, _XYZ[axis], box_from_clip, brightness)
            self._gl.end_mixing()
            return target
        owner = np.concatenate([np.full(len(part.centres_mm), index) for index, part in enumerate(parts)])
        number = np.concatenate([np.arange(len(part.centres_mm)) for part in parts])
        order = _back_to_front(np.concatenate([part.centres_mm for part in parts]), box_from_clip, _XYZ[axis])
        # Slices of one texture that follow each other are one call.
        for run in np.split(order, np.flatnonzero(np.diff(owner[order])) + 1):
            part = parts[owner[run[0]]]
            self._gl.draw(part.handle, part.positions, part.coordinates, part.triangles(number[run]))
        return target

    def _draw_between(self, parts: list[_Part], axis: int, box_from_clip: Float64Array, brightness: float) -> None:
        """Draw polygons that mix the two slices around them, with two texture units."""
        held = [(part, number) for part in parts for number in range(len(part.centres_mm))]
        layers = parts[0].layers
        slices = (np.arange(len(held) * layers) + 0.5) / layers
        grid = self.level.grid
        centres = np.minimum(slices * grid.spacing_mm_zyx[::-1][axis], grid.extent_mm_zyx[::-1][axis])
        between = np.clip(slices - 0.5, 0.0, len(held) - 1.0)
        for polygon in _back_to_front(centres, box_from_clip, axis):
            lower = int(between[polygon])
            one, other = held[lower], held[min(lower + 1, len(held) - 1)]
            positions = one[0].corners(one[1])
            positions[:, axis] = centres[polygon]
            pair = tuple(Unit(part.handle, part.texels(number)) for part, number in (one, other))
            self._gl.draw_mixed((pair[0], pair[1]), positions, _PATCHES, float(between[polygon] - lower), brightness)

    def _target_of(self, shape_hw: tuple[int, int]) -> int:
        if self._target is None or self._target[1] != shape_hw:
            self._target_stack.close()
            self._target = None
            self._target = (self._target_stack.enter_context(self._gl.target(shape_hw)), shape_hw)
        return self._target[0]

    def _edited(self, function: TransferFunction) -> dict[str, UInt8Array]:
        """Return the palettes of an edited transfer function, by the name of their texture."""
        manifest = self._package.manifest
        if manifest.editing is None or manifest.quantization is None:
            raise VolprepError("VP5023", path=self._package.path)
        window = manifest.quantization.window
        return {
            texture.name: code_colours(function, window, texture.reference_mm)
            for texture in self._textures
            if texture.reference_mm is not None
        }

    def _layout(self, texture: Texture, layout: SliceLayout) -> SliceLayout:
        palette = self._palettes.get(texture.name)
        if palette is None:
            return layout
        return layout.model_copy(update={"largest_opacity": largest_opacity(palette)})

    def _read(self, texture: Texture) -> bytes:
        data = self._package.read_bytes(texture.file)
        if texture.format == PALETTED:
            palette = self._palettes.get(texture.name)
            return data if palette is None else palette.tobytes() + data[PALETTE_BYTES:]
        image = ktx2.decode(data, texture.file)
        found = (image.format, image.shape_zyx, image.dimensions)
        named = ("rgba8unorm", texture.shape_zyx, 2)
        if found != named:
            raise VolprepError("VP5016", path=texture.file, found=found, named=named)
        return np.ascontiguousarray(image.data).tobytes()


def _back_to_front(centres_mm: Float64Array, box_from_clip: Float64Array, axis: int) -> NDArray[np.intp]:
    """Order of slices: farthest from the eye first, on both sides of it; no ray meets slices of both."""
    # Where the matrix of a perspective has its eye; with parallel rays a point at infinity, w = 0.
    eye = box_from_clip @ np.array([0.0, 0.0, -1.0, 0.0])
    if abs(eye[3]) * np.abs(centres_mm).max() <= 1e-9 * np.linalg.norm(eye[:3]):
        return np.argsort(eye[axis] * centres_mm)
    return np.argsort(-np.abs(centres_mm - eye[axis] / eye[3]))


def _part(handle: int, texture: Texture, layout: SliceLayout, grid: Grid) -> _Part:
    """Corners of the patches of every slice of a texture."""
    axis = _XYZ[layout.axis]
    spacing, extent = grid.spacing_mm_zyx[::-1], grid.extent_mm_zyx[::-1]
    _, height, width = texture.shape_zyx
    numbers = np.arange(layout.slices)
    # The last slice of a coarse level may lie outside, where the level has more than the volume.
    centres = np.minimum((layout.first + numbers + 0.5) * spacing[axis], extent[axis])
    positions = np.empty((layout.slices, 4, 4, 3))
    coordinates = np.empty((layout.slices, 4, 4, 2))
    positions[..., axis] = centres[:, None, None]
    rows, columns = layout.slice_shape_yx
    firsts = (numbers % layout.tiles_x * columns, numbers // layout.tiles_x * rows)
    for place, across in enumerate(_ACROSS[layout.axis]):
        texels, size = ((columns, width), (rows, height))[place]
        step = spacing[across]
        corners = np.array([0.0, step / 2, min((texels - 0.5) * step, extent[across]), extent[across]])
        corners[1] = min(corners[1], corners[2])
        inside = np.clip(corners / step, 0.5, texels - 0.5)
        shape = (1, 1, 4) if place == 0 else (1, 4, 1)
        positions[..., across] = corners.reshape(shape)
        coordinates[..., place] = (firsts[place][:, None, None] + inside.reshape(shape)) / size
    return _Part(
        handle,
        centres,
        layout.layers,
        positions.reshape(-1, 3).astype(np.float32),
        coordinates.reshape(-1, 2).astype(np.float32),
        layout.largest_opacity,
    )
