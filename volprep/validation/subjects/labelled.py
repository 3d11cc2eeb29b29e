"""Subject of validation for a scan with its segments: the oracle draws scan and package with their labels."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from volprep.truth.box import frequent_level
from volprep.truth.kept_parts import LabelledField, kept_parts, label_boxes, union
from volprep.truth.kept_segments import kept_segments, shown_labels
from volprep.truth.labelled import Labelled
from volprep.truth.labelled_decoded import Look, held_looks, joined, labelled_as, parted, picture_of_labels
from volprep.truth.labelled_light import light_of_labels
from volprep.truth.oracle import OraclePicture
from volprep.truth.volume import Volume
from volprep.validation.results.seen import KeptStyle
from volprep.validation.subjects.same_field import Part, part_of
from volprep.validation.subjects.subject import Subject
from volprep_formats.arrays import Float64Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.package.channel import Level
from volprep_formats.package.parts.segments.record import Segments, looks
from volprep_formats.package.parts.segments.texels import held_labels
from volprep_formats.package.reader import Package
from volprep_formats.package.transfer_function import TransferFunction

KeptParts = Callable[[list[int], str], Float64Array]
"""Returns the kept light of each connected part of a segment, given its labels and its style."""


def kept_styles(  # noqa: PLR0917 - segments, what they give, and what is asked
    segments: Segments,
    scan: Float64Array,
    level: Float64Array,
    voxels_of_level: Float64Array,
    least: float,
    kept_parts: KeptParts,
) -> tuple[KeptStyle, ...]:
    """Return the kept light of each visible style.

    `scan` and `level` are the light of each label, and `voxels_of_level` is its size in voxels of the level; `least` is
    the kept light that is allowed. Nothing can hold less than half a voxel.
    """
    shown = shown_labels(segments, scan)
    found = []
    for transfer in segments.transfers:
        own = shown & np.array([label.transfer == transfer for label in segments.labels])
        if not own.any():
            continue
        kept = kept_segments(segments, scan, level, own)
        labels = {name: _labels(segments, own, name) for name in kept}
        gone = [name for name, part in kept.items() if part < least]
        small = {name for name in gone if voxels_of_level[labels[name]].sum() < 0.5}
        name = min(kept, key=lambda segment: kept[segment], default=None)
        parts = {segment: kept_parts(labels[segment], transfer) for segment in kept if segment not in gone}
        found.append(
            KeptStyle(
                transfer=transfer,
                kept_light=float(level[own].sum() / scan[own].sum()),
                segments=len(kept),
                least=name,
                least_kept_light=None if name is None else kept[name],
                lost=tuple(name for name in gone if name not in small),
                too_small=tuple(name for name in gone if name in small),
                lost_parts=tuple(
                    f"{value} ({lost} of {len(lights)} parts)"
                    for value, lights in parts.items()
                    if (lost := int((lights < least).sum()))
                ),
            )
        )
    return tuple(found)


def _labels(segments: Segments, own: NDArray[np.bool_], name: str) -> list[int]:
    return [number for number in np.flatnonzero(own).tolist() if name in segments.labels[number].segments]


class LabelledSubject(Subject):
    """A package that draws a scan with its segments, the scan, and the labels of the scan."""

    def __init__(
        self, package: Package, scan: Volume, picture_size: int, labels: NDArray[np.uint16], derived: Segments
    ) -> None:
        """Take the package, its scan, the size of pictures, and labels and segments as they follow from the scan."""
        self._labels = labels
        self._derived = derived
        super().__init__(package, scan, picture_size, {})
        self._held: dict[int, NDArray[np.uint16]] = {}

    @property
    def is_of_several(self) -> bool:
        """Whether several transfer functions are drawn in one picture: the styles of labels."""
        return True

    @property
    def has_jumps_at_borders(self) -> bool:
        """Whether colour or extinction jump where segments meet."""
        return self._derived.border == "crisp" or self.scan.normals is not None

    def _styles(self, transfer: str) -> tuple[str, ...]:
        """Return the transfer functions of a picture."""
        return self._derived.transfers if transfer == self._derived.name else (transfer,)

    def functions(self, transfer: str) -> tuple[TransferFunction, ...]:
        """Return the transfer functions of all styles."""
        return tuple(self.function(name) for name in self._styles(transfer))

    def has_own_table(self, transfer: str, level: int) -> bool:
        """Return whether a style has a table of its own at `level`."""
        own = super().has_own_table
        return any(own(name, level) for name in self._styles(transfer))

    def truth(self, transfer: str, view: str) -> OraclePicture:
        """Draw the scan at full precision."""
        functions = {name: self.function(name) for name in self._styles(transfer)}
        return self._with(self.scan, self._labels, looks(self._derived), functions, view)

    def on_data_beside(
        self, truth: OraclePicture, transfer: str, view: str, level: int, *, apart: int = 1
    ) -> OraclePicture:
        """Return what `on_data` draws; the truth is of no use, because many rays meet changed voxels."""
        del truth
        return self.sparse(apart).on_data(transfer, view, level)

    def _on_data(self, transfer: str, view: str, level: int) -> OraclePicture:
        names = self._styles(transfer)
        own = super().has_own_table
        functions = {name: self.table(name, level) if own(name, level) else self.function(name) for name in names}
        return self._with(self.level(level), self._held_labels(level), held_looks(self.package), functions, view)

    def on_volumes(self, volumes: Sequence[Volume], transfer: str, view: str) -> OraclePicture:
        """Draw box means of the scan with the most frequent label of each box."""
        (volume,) = volumes
        manifest = self.package.manifest
        grid, level = manifest.grid, next(level for level in manifest.levels if level.grid == volume.grid)
        if grid is None:
            msg = "a sealed package without a grid"
            raise ValueError(msg)
        labels = frequent_level(self._labels[part_of(self.scan.grid, grid)], level.factors_zyx)
        functions = {name: self.function(name) for name in self._styles(transfer)}
        return self._with(volume, labels, looks(self._derived), functions, view)

    def kept_styles(self, level: Level, least: float) -> tuple[KeptStyle, ...]:
        """Return the kept light of each visible style of segments at a coarse level; `least` is allowed."""
        grid = self.package.manifest.grid
        if grid is None:
            msg = "a sealed package without a grid"
            raise ValueError(msg)
        box = part_of(self.scan.grid, grid)
        scan = self._field(self.scan.stored[box], self._labels[box], self.scan, grid)
        volume = self.level(level.index)
        coarse = self._field(volume.stored, self._held_labels(level.index), volume, level.grid)
        boxes = label_boxes(scan.labels)

        def parts(labels: list[int], transfer: str) -> Float64Array:
            return kept_parts(scan, coarse, labels, union([boxes[k] for k in labels]), self.function(transfer))

        voxels = np.bincount(scan.labels.ravel(), minlength=len(self._derived.labels)) / math.prod(level.factors_zyx)
        return kept_styles(self._derived, self._light(scan), self._light(coarse), voxels, least, parts)

    def _field(
        self, stored: NDArray[np.generic], labels: NDArray[np.uint16], volume: Volume, grid: Grid
    ) -> LabelledField:
        return LabelledField(stored, volume.slope, volume.intercept, labels, math.prod(grid.spacing_mm_zyx))

    def _light(self, field: LabelledField) -> Float64Array:
        functions = [self.function(label.transfer) for label in self._derived.labels]
        return light_of_labels(field.stored, field.slope, field.intercept, field.labels, functions, field.voxel_mm3)

    def on_table(self, transfer: str, view: str, level: int) -> OraclePicture:
        """Draw what the package holds of `level`, with lookup tables as transfer functions."""
        functions = {name: self.table(name, level) for name in self._styles(transfer)}
        return self._with(self.level(level), self._held_labels(level), held_looks(self.package), functions, view)

    def _held_labels(self, level: int) -> NDArray[np.uint16]:
        """Return the labels of a level as its texture holds them."""
        if level not in self._held:
            textures = self.package.manifest.textures
            self._held[level] = held_labels(textures, level, self.package.read_bytes)
        return self._held[level]

    def voxels(self, part: Part) -> NDArray[np.generic]:
        """Return voxels of the scan joined with their labels."""
        return joined(self.scan.stored[part], self._labels[part])

    def through(
        self, volume: Volume, transfer: str, box_from_clip: Float64Array, shape_hw: tuple[int, int]
    ) -> OraclePicture:
        """Draw a volume of joined voxels through any camera in its box."""
        stored, labels = parted(volume.stored)
        functions = {name: self.function(name) for name in self._styles(transfer)}
        labelled = self._labelled(labels, looks(self._derived), functions)
        return self._pictured_with(replace(volume, stored=stored), labelled, box_from_clip, shape_hw)

    def _with(
        self,
        volume: Volume,
        labels: NDArray[np.uint16],
        shown: Sequence[Look],
        functions: dict[str, TransferFunction],
        view: str,
    ) -> OraclePicture:
        labelled = self._labelled(labels, shown, functions)
        return self._pictured_with(volume, labelled, *self._rays(self.cameras[view], volume.grid))

    def _labelled(
        self, labels: NDArray[np.uint16], shown: Sequence[Look], functions: dict[str, TransferFunction]
    ) -> Labelled:
        styles = [functions[label.transfer] for label in self._derived.labels]
        if len(shown) < len(styles) or int(labels.max()) >= len(styles):
            problem = f"it has looks of {len(shown)} labels, and labels up to {int(labels.max())}"
            raise VolprepError("VP4011", path=self.package.path, problem=problem)
        return labelled_as(labels, styles, shown, self._derived.border)

    def _pictured_with(
        self, volume: Volume, labelled: Labelled, box_from_clip: Float64Array, shape_hw: tuple[int, int]
    ) -> OraclePicture:
        quantization = self.package.manifest.quantization
        if quantization is None:
            raise VolprepError("VP4011", path=self.package.path, problem="a sealed package without a quantization")
        return picture_of_labels(volume, labelled, self.compositing, quantization.window, box_from_clip, shape_hw)
