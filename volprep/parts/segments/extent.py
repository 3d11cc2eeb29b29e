"""Where the styles of segments are: elsewhere a transfer function shows nothing, whatever the values are."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from volprep.parts.segments.looks import segments_of
from volprep.scan.segments.record import FoundSegments, VoxelBox
from volprep.scene.scene import Scene
from volprep_formats.package.parts.segments.record import Segments


def style_boxes(scene: Scene, found: FoundSegments | None) -> dict[str, VoxelBox]:
    """Return, for each transfer function that shows labels, the box around their voxels; empty without segments.

    Raises VP3222 for a style of an unknown segment, VP3223 for an unknown transfer function.
    """
    if found is None or scene.segments is None:
        return {}
    record, order = segments_of(found, scene.segments, [each.name for each in scene.transfer], scene.name)
    of_style: dict[str, list[VoxelBox]] = {name: [] for name in record.transfers}
    for label, box in enumerate(found.boxes):
        if box is not None:
            of_style[record.labels[order[label]].transfer].append(box)
    return {name: _around(boxes) for name, boxes in of_style.items()}


def _around(boxes: Sequence[VoxelBox]) -> VoxelBox:
    z0, y0, x0 = (min((box.start_zyx[axis] for box in boxes), default=0) for axis in range(3))
    z1, y1, x1 = (max((box.stop_zyx[axis] for box in boxes), default=0) for axis in range(3))
    return VoxelBox(start_zyx=(z0, y0, x0), stop_zyx=(z1, y1, x1))


def style_blocks(
    record: Segments, found: FoundSegments | None, shape_zyx: tuple[int, int, int]
) -> dict[str, NDArray[np.bool_]]:
    """Return, for each transfer function that shows segments only, the measured blocks of the source that have any."""
    if found is None:
        return {}
    outside = {label.transfer for label in record.labels if not label.segments}
    bits = np.unpackbits(np.frombuffer(bytes.fromhex(found.blocks), np.uint8), count=math.prod(shape_zyx))
    blocks = bits.astype(np.bool_).reshape(shape_zyx)
    return {name: blocks for name in record.transfers if name not in outside}
