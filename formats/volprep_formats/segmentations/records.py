"""Records of a segmentation: its segments, with their voxels or contours."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from volprep_formats.arrays import Float64Array
from volprep_formats.grid import Grid

MOST_SEGMENTS = 4096
"""Largest number of segments in one segmentation."""
MOST_VOXELS = 2**31
"""Largest number of voxels of a segmentation."""
_NAMED = 20
"""Segments that a remark names."""

LabelArray = NDArray[np.uint16]
"""Labels [z, y, x]; 0 is no segment."""


@dataclass(frozen=True)
class ScanFrame:
    """Identifiers that tell where a segmentation lies. Compared, never shown whole."""

    uid: str = ""
    """FrameOfReferenceUID; empty if the scan names none."""
    images: frozenset[str] = frozenset()
    """SOPInstanceUID of each image."""


@dataclass(frozen=True)
class Code:
    """A coded name."""

    scheme: str
    """Vocabulary, for example SCT."""
    value: str
    """Code in this vocabulary, for example 10200004. Modifiers such as laterality follow after a plus sign."""
    meaning: str
    """Meaning of the code, in words."""
    is_public: bool
    """Whether code and meaning are in a public table: others are free text, which may name a patient."""


@dataclass(frozen=True)
class SourceSegment:
    """One segment, as its file describes it."""

    number: int
    """Number in the file."""
    name: str = ""
    """Free text; it may name a patient."""
    code: Code | None = None
    """Coded name, if the file has one."""
    colour: tuple[float, float, float] | None = None
    """Recommended colour, sRGB from 0 to 1."""


@dataclass(frozen=True)
class LabelVolume:
    """Segments as voxels."""

    segments: tuple[SourceSegment, ...]
    """All segments, in the order of their numbers."""
    grid: Grid
    """Where the voxels lie."""
    labels: LabelArray
    """A label for each voxel; voxels where segments overlap have labels of their own."""
    members: tuple[tuple[int, ...], ...]
    """For each label from 0: indices of its segments, ascending. Label 0 has none."""
    frame_of_reference: str = ""
    """UID of the coordinate system in which the grid lies; empty if the file does not say."""
    remarks: tuple[str, ...] = ()
    """Notes for the user."""


@dataclass(frozen=True)
class Contours:
    """Segments as closed planar contours in patient space."""

    segments: tuple[SourceSegment, ...]
    """All segments, in the order of their numbers."""
    rings: tuple[tuple[Float64Array, ...], ...]
    """Of each segment: its contours, each [points, (x, y, z)] in millimetres (LPS)."""
    items: tuple[tuple[int, ...], ...]
    """Of each contour: the item of the file that it is in. Items of one segment are united."""
    frame_of_reference: str = ""
    """UID of the coordinate system of the points; empty if the file does not say."""
    images: frozenset[str] = frozenset()
    """SOPInstanceUID of each image on which the file says that the contours are drawn."""
    remarks: tuple[str, ...] = ()
    """Notes for the user."""


Segmentation = LabelVolume | Contours


def numbers_text(numbers: Sequence[int]) -> str:
    """List numbers of segments, the first ones of many."""
    more = f" and {len(numbers) - _NAMED} more" if len(numbers) > _NAMED else ""
    return f"{', '.join(map(str, numbers[:_NAMED]))}{more}"
