"""Level 0 becomes sub-volumes with shared voxels, and a grid of points to walk on.

The stage reads a row of pieces along x at a time, so that neither depth nor height of the volume counts for memory.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep.compositing import COMPOSITINGS
from volprep.parts.stage import Stage, Work, any_channel, required
from volprep.parts.subvolumes.cuts import boxes_zyx, cuts_along, grid_points
from volprep.parts.subvolumes.decision import GRID
from volprep.parts.subvolumes.piece import tiled
from volprep.parts.texels import texel_reader, texels_of
from volprep.parts.work import codes_of_source, source_info
from volprep.plan.products import SegmentsPlan, SubvolumesPlan
from volprep.plan.records import ChannelPlan
from volprep.plan.room import one_channel
from volprep.scan.slabs import RawVolume, bytes_of, slab_ranges
from volprep_formats.arrays import UInt8Array
from volprep_formats.grid import Index
from volprep_formats.package.function_table import Table
from volprep_formats.package.manifest import Contribution, SubvolumeFiles
from volprep_formats.package.parts.segments.texels import flagged, label_texels, labels_of_texels
from volprep_formats.package.parts.subvolumes.record import Cuts, Subvolume, SubvolumeGrid, ViewThresholds, encode_grid
from volprep_formats.package.storage.draft import Draft
from volprep_formats.package.storage.files import SEGMENT_LABELS
from volprep_formats.package.texture import dimension_of
from volprep_formats.progress import Progress
from volprep_formats.record import Record, present
from volprep_formats.textures import ktx2


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
        behind = [slice(span.start, min(span.stop + 1, n)) for span, n in zip((z, y), self.shape_zyx, strict=False)]
        rows_z, rows_y = (
            slice(start + span.start, start + span.stop) for span, start in zip(behind, self.start_zyx, strict=False)
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


def _settings(plan: ChannelPlan) -> tuple[Record, ...]:
    parts = present(plan.part(SubvolumesPlan), plan.part(SegmentsPlan))
    return (*parts, plan.quantize, *plan.transfer_functions, *plan.tables, plan.shared.crop)


def _run(draft: Draft, plan: ChannelPlan, progress: Progress) -> Contribution:
    wanted = required(plan.part(SubvolumesPlan))
    codes = codes_of_source(draft, plan)
    # Mosaics have one layout, in which a remainder would take as much as a whole piece.
    even = wanted.mosaic is not None
    z, y, x = (cuts_along(n, wanted.size, even=even, ghost=wanted.ghost) for n in codes.shape_zyx)
    progress.start("grid", (len(z) - 1) * (len(y) - 1) * (len(x) - 1))
    subvolumes = tuple(_pieces(draft, plan, codes, (z, y, x), progress))
    if wanted.whole is not None and all(wanted.whole not in volume.files for volume in plan.volumes):
        draft.write(wanted.whole, "subvolume", _whole(plan, codes))
    grid = SubvolumeGrid(
        shape_zyx=codes.shape_zyx,
        size=wanted.size,
        cuts_zyx=(z, y, x),
        ghost=wanted.ghost or None,
        texture_format=wanted.format,
        dimension=dimension_of(wanted.mosaic),
        mosaic=wanted.mosaic,
        filter=plan.quantize.filter,
        whole=wanted.whole,
        subvolumes=subvolumes,
        points=grid_points((z, y, x)),
        view=ViewThresholds(),
    )
    draft.write(GRID, "grid", encode_grid(grid))
    files = tuple(piece.file for piece in subvolumes if piece.file is not None)
    return Contribution(subvolumes=SubvolumeFiles(grid=GRID, pieces=files, whole=wanted.whole))


def _pieces(
    draft: Draft, plan: ChannelPlan, codes: RawVolume, cuts_zyx: tuple[Cuts, Cuts, Cuts], progress: Progress
) -> Iterator[Subvolume]:
    counts = [len(cuts) - 1 for cuts in cuts_zyx]
    labels = piece_labels(draft, plan)
    row: NDArray[Any] = np.empty((0, 0, 0), codes.dtype)
    labelled: UInt8Array | None = None
    for number, (z, y, x) in enumerate(boxes_zyx(cuts_zyx, required(plan.part(SubvolumesPlan)).ghost)):
        k, j, i = np.unravel_index(number, counts)
        if i == 0:
            row = codes.read_rows(z, y)
            labelled = None if labels is None else labels.rows(z, y)
        own = None if labelled is None else labelled[:, :, x]
        yield _piece(draft, plan, row[:, :, x], own, f"subvolumes/{i}-{j}-{k}.ktx2")
        progress.advance()


def _piece(draft: Draft, plan: ChannelPlan, codes: NDArray[Any], labels: UInt8Array | None, file: str) -> Subvolume:
    wanted = required(plan.part(SubvolumesPlan))
    low, high = int(codes.min()), int(codes.max())
    label, same_labels = (None, True) if labels is None else _only_label(labels)
    if not wanted.pieces or (same_labels and _is_empty(plan, wanted, low, high)):
        return Subvolume(minimum=low, maximum=high, label=label or None)
    texels = texels_of(codes, wanted.format)
    if labels is not None:
        texels = np.concatenate([texels[..., None], labels], axis=-1)
    draft.write(file, "subvolume", _texture(wanted, texels))
    return Subvolume(minimum=low, maximum=high, file=file)


def _only_label(texels: UInt8Array) -> tuple[int, bool]:
    """Return a label of a piece, and whether all its voxels have it: labels of neighbours count at borders."""
    labels = labels_of_texels(texels[..., 0] if texels.shape[-1] == 1 else texels)
    return int(labels.flat[0]), bool((labels == labels.flat[0]).all())


def _texture(wanted: SubvolumesPlan, texels: NDArray[Any]) -> Iterator[bytes | memoryview]:
    if wanted.mosaic is None:
        z, y, x = texels.shape[:3]
        return ktx2.encode(ktx2.Ktx2Image(wanted.format, (z, y, x), texels, 3))
    head = ktx2.header(wanted.format, (1, *wanted.mosaic.texture_shape_yx), 2)
    return iter((head, bytes_of(tiled(texels, wanted.mosaic))))


def _is_empty(plan: ChannelPlan, wanted: SubvolumesPlan, low: int, high: int) -> bool:
    """Return whether a piece with codes from `low` to `high` looks like a constant piece of the code `low`."""
    if low == high:
        return True
    if wanted.keep_empty:
        return False
    first, last = plan.quantize.window
    width = (last - first) / (2**plan.quantize.bits - 1)
    # The filter of a table reaches to the next entry.
    ends = first + low * width - plan.value_slack, first + high * width + plan.value_slack
    shown = COMPOSITINGS[plan.shared.compositing].visible_table
    return all(shown(Table.exact(function)).largest_extinction(*ends) == 0.0 for function in plan.transfer_functions)


def _whole(plan: ChannelPlan, codes: RawVolume) -> Iterator[bytes | memoryview]:
    """Return the file to seek in: one voxel in a texel, also where pieces are mosaics."""
    texel = one_channel(plan.quantize.bits, plan.profile)
    assert texel is not None  # noqa: S101 - else there is no room for pieces either
    yield ktx2.header(texel, codes.shape_zyx, 3)
    read = texel_reader(codes, texel)
    for z0, z1 in slab_ranges(codes.shape_zyx[0], codes.slice_bytes):
        yield bytes_of(read(z0, z1))


STAGE = Stage(
    name="grid",
    summary="Cut level 0 into sub-volumes that share a layer of voxels, for scans that a device cannot hold at once.",
    options=("grid", ("size", "layout")),
    reads=("quantize",),
    channel=Work(_settings, _run),
    is_needed=any_channel(lambda plan: plan.part(SubvolumesPlan)),
)
