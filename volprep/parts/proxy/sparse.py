"""Occupied blocks of level 0 from an OpenVDB tree, without its voxels: for sources that are mostly background.

For programs that want the mesh of a .vdb file and no package. A package's own meshes come from its codes, which its
build has made anyway: measuring the codes takes 1 ms for 112×222×111 voxels of smoke, and 21 ms for 273×353×242 voxels
with 4 % active; reading the tree in a guarded worker takes 220 and 370 ms. A program that reads the tree need not read
the voxels, which would take 100 and 1650 ms (blocks of 8³, one thread of a loaded machine). Codes rise with values, so
that the code of a block's least value is its least code: both ways give the same blocks.
"""

import numpy as np
from numpy.typing import NDArray

from volprep.kernels import _native
from volprep.parts.texels import texels_of
from volprep.plan.records import CropPlan, QuantizePlan
from volprep.scan.block_ranges import BlockRanges
from volprep_formats.arrays import Float32Array
from volprep_formats.package.profile import TextureFormat
from volprep_formats.readers.vdb.reader import VdbSource


def ranges_of_tree(
    source: VdbSource, crop: CropPlan, quantize: QuantizePlan, block: int, texel: TextureFormat
) -> BlockRanges:
    """Return the ranges of blocks of level 0, as `block_ranges` measures them on texels of a format.

    Raises what the source does.
    """
    z, y, x = (stop - start for start, stop in zip(crop.start_zyx, crop.stop_zyx, strict=True))
    ends = source.block_ranges(crop.start_zyx, (z, y, x), block)
    low, high = (_texels(each, quantize, texel) for each in ends)
    return BlockRanges(low, high, block)


def _texels(values: Float32Array, quantize: QuantizePlan, texel: TextureFormat) -> NDArray[np.generic]:
    codes = np.empty(values.shape, np.uint8 if quantize.bits == 8 else np.uint16)
    histogram = np.zeros(2**quantize.bits, np.uint64)
    _native.quantize(np.ascontiguousarray(values), 1.0, 0.0, *quantize.window, codes, histogram)
    texels = texels_of(codes, texel)
    return texels.astype(np.float32) if texels.dtype == np.float16 else texels
