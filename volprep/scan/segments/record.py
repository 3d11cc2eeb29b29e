"""Record of the segments that an import found in a scan: working data of a draft."""

from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import product
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from volprep.scan.block_ranges import blocks_with
from volprep.scan.segments.fitted import Fitted
from volprep.scan.statistics import MEASURED_BLOCK
from volprep_formats.label_tables import table_of
from volprep_formats.label_tables.table import LABEL_TABLES
from volprep_formats.package.values import Sha256
from volprep_formats.record import Record
from volprep_formats.segmentations.overlaps import count_of
from volprep_formats.segmentations.records import LabelArray, numbers_text

_INSIDE, _SMALLER = 0.9, 0.8
"""A segment holds another one with this part of its voxels, which are at most this part of its own."""
Share = Annotated[float, Field(ge=0.0, le=1.0)]


class FoundCode(Record):
    """A coded name as the source has it."""

    scheme: str
    """Vocabulary."""
    value: str
    """Code in this vocabulary."""
    meaning: str
    """Meaning of the code."""
    public: bool
    """Whether code and meaning are in a public table."""


class FoundSegment(Record):
    """One segment of the source. Its name is free text, which only drafts hold."""

    number: Annotated[int, Field(ge=0)]
    """Number in the source."""
    name: str
    """Free text."""
    public: str = ""
    """Name in a public table of labels."""
    code: FoundCode | None
    """Coded name."""
    colour: tuple[Share, Share, Share] | None
    """Recommended colour, sRGB."""
    volume_ml: Annotated[float, Field(ge=0.0)]
    """Volume, as the source has it."""


class VoxelBox(Record):
    """A box of voxels of the scan."""

    start_zyx: tuple[int, int, int]
    """First voxel."""
    stop_zyx: tuple[int, int, int]
    """Voxel after the last one."""


class FoundSegments(Record):
    """The segments of a scan."""

    segments: tuple[FoundSegment, ...]
    """All segments of the source."""
    members: tuple[tuple[int, ...], ...]
    """For each label from 0: indices of its segments."""
    boxes: tuple[VoxelBox | None, ...]
    """For each label the box around its voxels; None if it has none."""
    voxels: tuple[int, ...]
    """For each label its number of voxels."""
    blocks: str
    """Whether a block of 16³ cells has a voxel of a segment: a bit for each block, in hexadecimal digits."""
    sha256: Sha256
    """Digest of the labels, 16 bits each, little-endian."""
    remarks: tuple[str, ...] = ()
    """Remarks for the user."""


def found_segments(fitted: Fitted, sha256: str, table: str | None = None) -> FoundSegments:
    """Return the record of fitted segments, whose labels have the digest `sha256`.

    A `table` of labels gives names and colours to segments without them. Raises VP1300 for one that cannot be read.
    """
    known = table_of(table, Path("/")).by_number if table else {}
    public = table in LABEL_TABLES
    segments = tuple(
        FoundSegment(
            number=segment.number,
            name=segment.name or (known[segment.number].name if segment.number in known and not public else ""),
            public=known[segment.number].name if segment.number in known and public else "",
            code=None
            if segment.code is None
            else FoundCode(
                scheme=segment.code.scheme,
                value=segment.code.value,
                meaning=segment.code.meaning,
                public=segment.code.is_public,
            ),
            colour=segment.colour or (srgb_of(known[segment.number].colour) if segment.number in known else None),
            volume_ml=volume_ml,
        )
        for segment, volume_ml in zip(fitted.segments, fitted.volumes_ml, strict=True)
    )
    boxes = _boxes(fitted.labels, len(fitted.members))
    return FoundSegments(
        segments=segments,
        members=fitted.members,
        boxes=boxes,
        voxels=tuple(count_of(fitted.labels, len(fitted.members)).tolist()),
        blocks=np.packbits(blocks_with(fitted.labels > 0, MEASURED_BLOCK)).tobytes().hex(),
        sha256=sha256,
        remarks=(*fitted.remarks, *_empty(fitted, boxes)),
    )


def holding_segments(found: FoundSegments) -> tuple[int, ...]:
    """Return the numbers of segments inside which another segment lies: a body around its organs."""
    shared: Counter[tuple[int, int]] = Counter()
    for members, voxels in zip(found.members, found.voxels, strict=True):
        shared.update(dict.fromkeys(product(members, members), voxels))
    holding = {
        outer
        for (outer, inner), voxels in shared.items()
        if outer != inner and voxels >= _INSIDE * shared[inner, inner] and voxels <= _SMALLER * shared[outer, outer]
    }
    return tuple(found.segments[index].number for index in sorted(holding) if shared[index, index])


def _empty(fitted: Fitted, boxes: Sequence[VoxelBox | None]) -> Iterator[str]:
    """Name segments without a voxel."""
    held = {index for members, box in zip(fitted.members, boxes, strict=True) if box for index in members}
    numbers = [segment.number for index, segment in enumerate(fitted.segments) if index not in held]
    if numbers:
        yield f"segments without a voxel of the scan: {numbers_text(numbers)}"


def _boxes(labels: LabelArray, count: int) -> tuple[VoxelBox | None, ...]:
    """Return the box of each label from 0 to count - 1; None for one that no voxel has."""
    nz, ny, nx = labels.shape
    z_with, y_with, x_with = (np.zeros((count, n), np.bool_) for n in (nz, ny, nx))
    ends = np.ones((ny, nx + 1), np.bool_)
    for z, plane in enumerate(labels):
        # The first and the last voxel of each run of equal labels along x are enough for a box.
        np.not_equal(plane[:, 1:], plane[:, :-1], out=ends[:, 1:-1])
        for marked in (ends[:, :-1], ends[:, 1:]):
            y, x = np.nonzero(marked)
            label = plane[y, x]
            z_with[label, z] = y_with[label, y] = x_with[label, x] = True
    return tuple(_box(value) for value in zip(z_with, y_with, x_with, strict=True))


def _box(with_label: Sequence[NDArray[np.bool_]]) -> VoxelBox | None:
    if not with_label[0].any():
        return None
    (z0, z1), (y0, y1), (x0, x1) = (np.flatnonzero(along)[[0, -1]].tolist() for along in with_label)
    return VoxelBox(start_zyx=(z0, y0, x0), stop_zyx=(z1 + 1, y1 + 1, x1 + 1))


def srgb_of(text: str) -> tuple[float, float, float]:
    """Return a colour "#rrggbb" as sRGB from 0 to 1."""
    red, green, blue = (int(text[i : i + 2], 16) / 255 for i in (1, 3, 5))
    return red, green, blue
