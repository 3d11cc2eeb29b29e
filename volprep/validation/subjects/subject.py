"""The scan and the package's own data, drawn by the oracle with the package's cameras for comparison."""

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import replace
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from volprep.compositing import COMPOSITINGS
from volprep.truth.camera import Camera, standard_views
from volprep.truth.colour import media_of_colour
from volprep.truth.decoded import baked_fields, level_volume, own_table, table_function
from volprep.truth.lit import BakedField, Normals, with_baked
from volprep.truth.metrics import picture_error
from volprep.truth.oracle import DEFAULT_TOLERANCE, OraclePicture
from volprep.truth.seen import seen_error
from volprep.truth.volume import Medium, Volume
from volprep.validation.results.measurements import ErrorNumbers
from volprep.validation.results.seen import KeptStyle
from volprep.validation.subjects.same_field import (
    Part,
    camera_of_every,
    camera_of_pixels,
    changed_voxels,
    every,
    pixels_around,
    reach_of,
)
from volprep_formats.arrays import Float64Array, FloatArray
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Affine, Grid
from volprep_formats.package.channel import Level
from volprep_formats.package.manifest import RenderSettings
from volprep_formats.package.program import CompositingName, PictureProgram
from volprep_formats.package.reader import Package
from volprep_formats.package.transfer_function import TransferFunction

_Float = TypeVar("_Float", bound=np.floating)
_LEAST_SMALL = 128
_LEAST_RAYS = 64
"""Width and height of the smallest pictures whose errors are a sample of a larger one's."""
DRAFT_TOLERANCE = 1e-4
"""A fortieth of a step of an 8-bit target: bound of the oracle where a sharper picture could change no verdict."""
_OF_SLICES = COMPOSITINGS["emission-absorption"]
"""Compositing that blended slices approximate."""


class Subject:
    """One package and its scan; or a package of several channels that are drawn together, and their subjects."""

    def __init__(
        self,
        package: Package,
        scan: Volume,
        picture_size: int,
        channels: Mapping[str, "Subject"] | None = None,
        placed: Mapping[str, Affine | None] | None = None,
    ) -> None:
        """Take the package, its scan, and the width and height of pictures in pixels.

        `channels` has the subjects of one picture, by the names of the transfer functions that are drawn together,
        and `placed` their registrations.
        """
        self.package = package
        self._channels = channels or {}
        self._placed = placed or {}
        media = (medium for picture in package.manifest.pictures for medium in picture.media)
        self._unlit = {medium.transfer for medium in media if medium.unlit}
        self.render = render_settings(package)
        self.step_mm = package.manifest.step_mm or min(package.manifest.levels[0].grid.spacing_mm_zyx)
        """Nominal distance of samples in the finest drawing; slices are as far apart as voxels."""
        self.scan = scan
        self.shape_hw = (picture_size, picture_size)
        self.grid = package.manifest.box
        """Grid whose box is that of the package: of its finest level, or of a picture. The scan's may have a border."""
        self.cameras = standard_views(self.grid, self.render.projection)
        """Standard views by name."""
        self.views = {name: camera.box_from_clip(self.grid, aspect=1.0) for name, camera in self.cameras.items()}
        """Matrix from clip coordinates to the package's box space by name of the standard view."""
        known = {function.name for function in package.manifest.transfer_functions}
        programs = [
            program for program in package.manifest.level_programs if (program.transfer in known) == (channels is None)
        ]
        self.programs = _finest(programs)
        """For each transfer function, or for the picture of several, the program that draws it at the finest level."""
        self._compositing = COMPOSITINGS[package.manifest.programs[0].compositing] if self.programs else _OF_SLICES
        self._levels: dict[int, Volume] = {}
        self._on_coarse: dict[tuple[str, str, int], OraclePicture] = {}
        self._changed_voxels: dict[str, NDArray[np.intp] | None] = {}
        self._apart = 1
        self._tolerance = DEFAULT_TOLERANCE
        self._turn: Float64Array | None = None

    @cached_property
    def small(self) -> "Subject":
        """The same subject in a quarter of the pixels, at least 128², for separating the parts of an error.

        The sweep and the comparison of levels use the same few pictures: those already drawn are kept.
        """
        return self.sparse(2, least=_LEAST_SMALL)

    @cached_property
    def smallest(self) -> "Subject":
        """The same subject in a 16th of the pixels, at least 64²: enough to see how an error falls with the step."""
        return self.sparse(4)

    def sparse(self, apart: int, least: int = _LEAST_RAYS) -> "Subject":
        """Return the same subject, of whose pictures every `apart`-th row and column is drawn.

        `apart` is a power of two, and is halved while less than `least` would be left.
        """
        sparse = self._copied()
        while apart > 1 and self.shape_hw[0] // apart < least:
            apart //= 2
        sparse._apart = apart
        return sparse

    def _copied(self) -> "Subject":
        """Return a copy that shares the decoded volumes, but neither pictures nor subjects made of this one."""
        copied = copy(self)
        copied._on_coarse = {}
        for name in ("small", "smallest", "drafted"):
            copied.__dict__.pop(name, None)
        return copied

    def of_its_rays(self, picture: NDArray[_Float]) -> NDArray[_Float]:
        """Return the pixels that it draws of a picture [H, W, 4], which may be sparse itself, but not more so."""
        return as_sparse(picture, every(self.shape_hw[0], self._apart))

    @cached_property
    def drafted(self) -> "Subject":
        """The same subject, whose oracle aims at a bound of DRAFT_TOLERANCE: enough where a verdict is clear."""
        drafted = self._copied()
        drafted._tolerance = DRAFT_TOLERANCE
        return drafted

    def has_baked_light(self, transfer: str) -> bool:
        """Return whether light that was computed once lights a transfer function."""
        return transfer in self._baked

    @cached_property
    def _baked(self) -> Mapping[str, BakedField]:
        """Precomputed light, by transfer function; its texture is made again from the scan and compared."""
        return baked_fields(self.package, self._turn)

    def turned(self, turn: Float64Array) -> "Subject":
        """Return the same subject with turnable light turned by a rotation [3, 3] of the patient's space."""
        other = self._copied()
        other._turn = turn
        other.__dict__.pop("_baked", None)
        return other

    @property
    def compositing(self) -> CompositingName:
        """Compositing of the package's rays; slices approximate emission and absorption."""
        return self._compositing.name

    @property
    def is_lit(self) -> bool:
        """Whether light falls on a channel."""
        return any(part.scan.normals is not None for part in self.channels)

    @property
    def is_of_several(self) -> bool:
        """Whether several channels are drawn in one picture."""
        return bool(self._channels)

    @property
    def has_jumps_at_borders(self) -> bool:
        """Whether colour or extinction jump where segments meet."""
        return False

    @property
    def channels(self) -> tuple["Subject", ...]:
        """Subjects in one picture: one for each of several channels, or this one."""
        return tuple(self._channels.values()) or (self,)

    @property
    def _is_colour(self) -> bool:
        """Whether the channels hold light and extinction."""
        return self.is_of_several and any(program.classification == "colour" for program in self.programs)

    @property
    def is_classified(self) -> bool:
        """Whether the package holds classified voxels: colours in place of values."""
        return any(texture.reference_mm is not None for texture in self.package.manifest.textures)

    def truth(self, transfer: str, view: str) -> OraclePicture:
        """Draw the scan at full precision."""
        return self._draw([Medium(part.scan, part.function(name)) for name, part in self._parts(transfer)], view)

    def on_data_beside(
        self, truth: OraclePicture, transfer: str, view: str, level: int, *, apart: int = 1
    ) -> OraclePicture:
        """Return the picture of `on_data`, given the truth of this view: only rays that differ are drawn.

        If most may differ, every `apart`-th row and column is drawn.
        """
        voxels = self._changed(transfer, level)
        if self.is_classified:
            return truth
        if voxels is None:
            return self.sparse(apart).on_data(transfer, view, level)
        picture = OraclePicture(truth.rgba.copy(), truth.bound.copy())
        volume = self.level(level)
        camera = self.cameras[view].box_from_clip(volume.grid, aspect=1.0)
        reach = reach_of(self.scan, volume) or 0
        for voxel in voxels:
            rows, columns = pixels_around(voxel, volume.grid, camera, self.shape_hw, reach)
            shape_hw = (rows.stop - rows.start, columns.stop - columns.start)
            if 0 not in shape_hw:
                part = self.through(volume, transfer, camera_of_pixels(camera, self.shape_hw, rows, columns), shape_hw)
                picture.rgba[rows, columns], picture.bound[rows, columns] = part.rgba, part.bound
        return picture

    def _changed(self, transfer: str, level: int) -> NDArray[np.intp] | None:
        if self.is_classified or self.is_of_several or self._compositing is not _OF_SLICES:
            return None
        if level != 0 or self.has_own_table(transfer, level):
            return None
        if transfer not in self._changed_voxels:
            self._changed_voxels[transfer] = changed_voxels(self.scan, self.level(level), self.function(transfer))
        return self._changed_voxels[transfer]

    def on_data(self, transfer: str, view: str, level: int) -> OraclePicture:
        """Draw the package's data of `level`, with the control points of the transfer function.

        A table of the level's own belongs to its data: it belongs to nothing else. Classified voxels have no values to
        integrate: for them this is the truth, and all error counts as drawing error.
        """
        if self.is_classified:
            return self.truth(transfer, view)
        key = (transfer, view, level)
        if key not in self._on_coarse:
            drawn = self._on_data(transfer, view, level)
            if level == 0:
                return drawn
            self._on_coarse[key] = drawn
        return self._on_coarse[key]

    def _on_data(self, transfer: str, view: str, level: int) -> OraclePicture:
        media = [
            Medium(
                part.level(level), part.table(name, level) if part.has_own_table(name, level) else part.function(name)
            )
            for name, part in self._parts(transfer)
        ]
        return self._draw(media, view)

    def on_codes(self, transfer: str, view: str, level: int) -> OraclePicture:
        """Draw the codes of `level` with the control points of the transfer function."""
        if not self.is_classified and not self.is_of_several and not self.has_own_table(transfer, level):
            return self.on_data(transfer, view, level)
        return self.on_volume(self.level(level), transfer, view)

    def on_volume(self, volume: Volume, transfer: str, view: str) -> OraclePicture:
        """Draw any volume with the control points of the transfer function."""
        return self._draw([Medium(volume, self.function(transfer))], view)

    def on_volumes(self, volumes: Sequence[Volume], transfer: str, view: str) -> OraclePicture:
        """Draw one volume of each channel with the control points of the transfer functions."""
        parts = zip(volumes, self._parts(transfer), strict=True)
        return self._draw([Medium(volume, part.function(name)) for volume, (name, part) in parts], view)

    def of_function(self, function: TransferFunction, view: str) -> OraclePicture:
        """Draw the scan at full precision with another transfer function, without precomputed light."""
        # Light is found by the name of its function.
        other = function.model_copy(update={"name": f"{function.name}, edited"})
        return self._draw([Medium(self.scan, other)], view)

    def on_table(self, transfer: str, view: str, level: int) -> OraclePicture:
        """Draw the package's data of `level`, with the lookup table as the transfer function."""
        if self.is_classified:
            return self.truth(transfer, view)
        media = [Medium(part.level(level), part.table(name, level)) for name, part in self._parts(transfer)]
        return self._draw(media, view)

    def has_own_table(self, transfer: str, level: int) -> bool:
        """Return whether `level` has a lookup table of its own."""
        return own_table(self.package, transfer, level)

    def table(self, transfer: str, level: int) -> TransferFunction:
        """Return the transfer function that the lookup table represents."""
        return table_function(self.package, transfer, level)

    def kept_styles(self, level: Level, least: float) -> tuple[KeptStyle, ...]:
        """Return the kept light of each visible style of segments at a coarse level; `least` is allowed. None here."""
        del level, least
        return ()

    def levels(self, program: PictureProgram) -> list[int]:
        """Levels where the transfer function of `program` is drawn in the same way, finest first."""
        same = (program.sampling, program.transfer)
        programs = self.package.manifest.level_programs
        return sorted(
            {level for program in programs if (program.sampling, program.transfer) == same for level in program.levels}
        )

    def functions(self, transfer: str) -> tuple[TransferFunction, ...]:
        """Return the transfer functions of a picture: the one of this name, or one for each of its channels."""
        return tuple(part.function(name) for name, part in self._parts(transfer))

    def function(self, transfer: str) -> TransferFunction:
        """Return the transfer function of this name."""
        return self.package.manifest.function(transfer)

    def _parts(self, transfer: str) -> Sequence[tuple[str, "Subject"]]:
        """Return the transfer functions of a picture, each with the subject that has its channel."""
        return [*self._channels.items()] or [(transfer, self)]

    def _draw(self, media: Sequence[Medium], view: str) -> OraclePicture:
        return self._seen(media, self.cameras[view])

    def voxels(self, part: Part) -> NDArray[np.generic]:
        """Return voxels of the scan as `through` draws them."""
        return self.scan.stored[part]

    def through(
        self, volume: Volume, transfer: str, box_from_clip: Float64Array, shape_hw: tuple[int, int]
    ) -> OraclePicture:
        """Draw any volume through any camera in its box with the control points of the transfer function."""
        return self._pictured([Medium(volume, self.function(transfer))], box_from_clip, shape_hw)

    def _seen(self, media: Sequence[Medium], camera: Camera) -> OraclePicture:
        return self._pictured(media, *self._rays(camera, media[0].volume.grid))

    def rays(self, view: str) -> tuple[Float64Array, tuple[int, int]]:
        """Return the camera of a standard view in the package's box, and height and width of its pictures."""
        return self._rays(self.cameras[view], self.grid)

    def _rays(self, camera: Camera, grid: Grid) -> tuple[Float64Array, tuple[int, int]]:
        """Return the camera in the box of a grid, and height and width of its pictures."""
        height, width = self.shape_hw
        matrix = camera_of_every(camera.box_from_clip(grid, aspect=1.0), self.shape_hw, self._apart)
        return matrix, (every(height, self._apart), every(width, self._apart))

    def _pictured(
        self, media: Sequence[Medium], box_from_clip: Float64Array, shape_hw: tuple[int, int]
    ) -> OraclePicture:
        drawn = [
            replace(
                medium,
                volume=replace(medium.volume, normals=self._normals_lit(medium.volume.normals, name)),
                placed=self._placed.get(name),
            )
            for medium, name in zip(media, self._channels or ("",), strict=True)
        ]
        return self._compositing.oracle(
            media_of_colour(drawn) if self._is_colour else drawn, box_from_clip, shape_hw, tolerance=self._tolerance
        )

    def _normals_lit(self, normals: Normals, name: str) -> Normals:
        """Return the light on the medium of a transfer function."""
        return None if name in self._unlit else with_baked(normals, self._baked)

    def level(self, level: int) -> Volume:
        """Decode the package's data of `level`."""
        if level not in self._levels:
            self._levels[level] = level_volume(self.package, level)
        return self._levels[level]


def _finest(programs: Sequence[PictureProgram]) -> tuple[PictureProgram, ...]:
    finest: dict[str, PictureProgram] = {}
    for program in programs:
        if program.transfer not in finest or min(program.levels) < min(finest[program.transfer].levels):
            finest[program.transfer] = program
    return tuple(finest.values())


def render_settings(package: Package) -> RenderSettings:
    """Return how a sealed package wants to be drawn. Raises VP4011 if it does not say."""
    render = package.manifest.render
    if render is None:
        raise VolprepError("VP4011", path=package.path, problem="a sealed package without render settings")
    return render


def as_sparse(picture: NDArray[_Float], rows: int) -> NDArray[_Float]:
    """Return the rows and columns of a picture [H, W, 4] that a sparse picture of the same, with `rows` rows, has."""
    apart = -(-len(picture) // rows)
    return picture[::apart, ::apart]


def errors(picture: FloatArray, truth: FloatArray) -> ErrorNumbers:
    """Compare two pictures [H, W, 4], premultiplied linear."""
    found, seen = picture_error(picture, truth), seen_error(picture, truth)
    return ErrorNumbers(
        rmse=found.rmse,
        maximum=found.maximum,
        seen_rmse=seen.rmse,
        off=seen.off,
        psnr_black_db=found.psnr_black_db,
        psnr_white_db=found.psnr_white_db,
        ssim_black=found.ssim_black,
        ssim_white=found.ssim_white,
    )
