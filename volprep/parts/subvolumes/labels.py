"""Labels of pieces: the labels and flags of the whole level 0, cut by the same grid."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from volprep.parts.work import source_info
from volprep.plan.products import SegmentsPlan
from volprep.plan.records import ChannelPlan
from volprep.scan.slabs import RawVolume
from volprep_formats.arrays import UInt8Array
from volprep_formats.grid import Index
from volprep_formats.package.parts.segments.texels import flagged, label_texels
from volprep_formats.package.storage.draft import Draft
from volprep_formats.package.storage.files import SEGMENT_LABELS


@dataclass(frozen=True)
class PieceLabels:
    """The labels of the source. Level 0 may be a part of it."""

    volume: RawVolume
    """Labels as they were imported."""
    order: NDArray[np.uint16]
    """For each of them its number in the package."""
    start_zyx: tuple[Index, Index, Index]
    """First voxel of level 0."""
    shape_zyx: tuple[int, int, int]
    """Number of voxels of level 0 along each axis."""
    wide: bool
    """Whether a label has two bytes."""

    def rows(self, z: slice, y: slice) -> UInt8Array:
        """Return texels of the rows `y` of the slices `z` of level 0, [z, y, x, byte]."""
        # The last cells may have several labels: their far corners are one voxel further along each axis.
        behind = [slice(each.start, min(each.stop + 1, n)) for each, n in zip((z, y), self.shape_zyx, strict=False)]
        rows_z, rows_y = (
            slice(start + each.start, start + each.stop) for each, start in zip(behind, self.start_zyx, strict=False)
        )
        first, count = self.start_zyx[2], self.shape_zyx[2]
        labels = self.order[self.volume.read_rows(rows_z, rows_y)[:, :, first : first + count]]
        own = slice(z.stop - z.start), slice(y.stop - y.start)
        texels = label_texels(labels[own], flagged(labels, None)[own], wide=self.wide)
        return texels.reshape(*texels.shape[:3], -1)


def piece_labels(draft: Draft, plan: ChannelPlan) -> PieceLabels | None:
    """Return the labels of the pieces of a channel; None without segments."""
    segments = plan.part(SegmentsPlan)
    if segments is None:
        return None
    source = source_info(draft.manifest, plan.channel).grid
    return PieceLabels(
        volume=RawVolume(draft.folder / SEGMENT_LABELS, source.shape_zyx, np.dtype(np.uint16)),
        order=np.array(segments.order, np.uint16),
        start_zyx=plan.shared.crop.start_zyx,
        shape_zyx=plan.grid.shape_zyx,
        wide=segments.wide,
    )
