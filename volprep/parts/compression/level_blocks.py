"""Blocks and pictures of a whole level: what the trials of one channel and of a volume in colour have in common."""

import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep.compositing import COMPOSITINGS
from volprep.parts.mosaic.packing import pack_mosaic
from volprep.plan.records import VolumePlan
from volprep.scene.scene import SceneRender
from volprep.truth.camera import Camera
from volprep.truth.volume import Medium
from volprep_formats.arrays import Float64Array, UInt8Array
from volprep_formats.textures.block_formats import CompressedFormat


def encoded_level(
    texels: Callable[[int, int], NDArray[Any]], volume: VolumePlan, form: CompressedFormat
) -> tuple[list[UInt8Array], float]:
    """Return blocks of each texture, [row, column, byte], and the seconds that encoding took.

    `texels(z0, z1)` gives slices z0 to z1 - 1 as `pack_mosaic` takes them.
    """
    from volprep_formats.textures.blocks import encode_blocks  # noqa: PLC0415 - needed only for compression

    assert volume.mosaic is not None  # noqa: S101 - compressed levels are mosaics
    parts, seconds = [], 0.0
    for part in range(volume.mosaic.textures):
        strips = []
        for strip in pack_mosaic(texels, volume.mosaic, part):
            start = time.perf_counter()
            strips.append(encode_blocks(np.asarray(strip, np.uint8), form))
            seconds += time.perf_counter() - start
        parts.append(np.concatenate(strips))
    return parts, seconds


def oracle_of_view(media: Sequence[Medium], camera: Camera, render: SceneRender) -> Float64Array:
    """Return the picture of a view, [row, column, RGBA], as the oracle draws it without light."""
    size = (render.picture_size, render.picture_size)
    matrix = camera.box_from_clip(media[0].volume.grid, aspect=1.0)
    return COMPOSITINGS[render.compositing].oracle(media, matrix, size).rgba
