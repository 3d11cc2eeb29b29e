"""Pictures of a walk as the oracle draws them: values, and with segments the label of each voxel."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from volprep.compositing import COMPOSITINGS
from volprep.render.cut import Cut
from volprep.truth.decoded import level_volume, light_of_program
from volprep.truth.labelled_decoded import held_looks, joined, labelled_as, parted, picture_of_labels
from volprep.truth.oracle import OraclePicture
from volprep.truth.part import Draw
from volprep.truth.volume import Medium, Volume
from volprep_formats.arrays import Float64Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.parts.segments.texels import held_labels
from volprep_formats.package.program import PictureProgram
from volprep_formats.package.reader import Package
from volprep_formats.package.transfer_function import TransferFunction


@dataclass(frozen=True)
class WalkVoxels:
    """Voxels that a program draws."""

    package: Package
    """Their package."""
    program: PictureProgram
    """The program of sub-volumes."""
    volume: Volume
    """Values, their grid and their light."""
    labels: NDArray[np.uint16] | None
    """[z, y, x], the label of each voxel; None without segments."""

    @property
    def joined(self) -> Volume:
        """The volume; with segments its stored values are joined with the labels."""
        if self.labels is None:
            return self.volume
        return replace(self.volume, stored=joined(self.volume.stored, self.labels))

    def drawn_with(self, functions: Mapping[str, TransferFunction]) -> Draw:
        """Return a function that draws such voxels with these transfer functions, by name."""
        segments, quantization = self.package.manifest.segments, self.package.manifest.quantization
        if quantization is None:
            raise VolprepError("VP4011", path=self.package.path, problem="a sealed package without a quantization")
        compositing, window = self.program.compositing, quantization.window

        def plain(part: Volume, matrix: Float64Array, shape_hw: tuple[int, int]) -> OraclePicture:
            medium = Medium(part, functions[self.program.transfer])
            return COMPOSITINGS[compositing].oracle([medium], matrix, shape_hw)

        if segments is None:
            return plain
        styles, looks = [functions[label.transfer] for label in segments.labels], held_looks(self.package)

        def with_labels(part: Volume, matrix: Float64Array, shape_hw: tuple[int, int]) -> OraclePicture:
            stored, labels = parted(part.stored)
            labelled = labelled_as(labels, styles, looks, segments.border)
            return picture_of_labels(replace(part, stored=stored), labelled, compositing, window, matrix, shape_hw)

        return with_labels


def shown_of_level(package: Package, program: PictureProgram, level: int) -> WalkVoxels:
    """Decode a whole level."""
    manifest = package.manifest
    held = None if manifest.segments is None else held_labels(manifest.textures, level, package.read_bytes)
    return WalkVoxels(package, program, level_volume(package, level), held)


def shown_of_cut(package: Package, program: PictureProgram, found: Cut) -> WalkVoxels:
    """Return a box of level 0, lit as the program of sub-volumes lights it."""
    light = None if program.lighting == "none" else light_of_program(package.manifest, program)
    return WalkVoxels(package, program, replace(found.volume, normals=light), found.numbers)
