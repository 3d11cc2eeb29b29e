"""The native kernels against the best public tools for the same work, on inputs of 117 MB each."""

from collections.abc import Iterator

import numpy as np
import SimpleITK
import tinybrain
from numpy.typing import NDArray
from skimage.transform import downscale_local_mean

from volprep.kernels import _native

from .contest import Contest

SLICES_OF_BYTES = 447
SIDE = 512
WINDOW = (20.0, 220.0)


def contests() -> Iterator[Contest]:
    """Give every contest, one after the other: their inputs need not be in memory together."""
    scan = _scan()
    yield _box(scan, {"skimage downscale_local_mean": lambda: downscale_local_mean(scan, (2, 2, 2))})
    yield _minmax(scan)
    yield _minmax(scan, 8)
    yield _quantize(scan)
    for dtype in (np.int16, np.uint16, np.float32):
        volume = scan[:: np.dtype(dtype).itemsize].astype(dtype)
        yield _box(volume)
        yield _minmax(volume)
        yield _quantize(volume)
        yield from _stored_values(volume)


def _scan() -> NDArray[np.uint8]:
    """Make a noisy ellipsoid in an empty surrounding: like a scan, and the same on every machine."""
    rng = np.random.default_rng(1)
    noise = np.tile(rng.normal(120, 25, (32, SIDE, SIDE)).clip(1, 255).astype(np.uint8), (14, 1, 1))[:SLICES_OF_BYTES]
    z, y, x = (np.linspace(-1, 1, n) ** 2 for n in noise.shape)
    return noise * (z[:, None, None] + y[:, None] + x < 1)


def _box(source: NDArray[np.generic], more_peers: dict | None = None) -> Contest:
    dst = np.empty(_native.box_reduced_shape(source.shape, (2, 2, 2)), source.dtype)
    image = SimpleITK.GetImageFromArray(source)
    return Contest(
        work="2×2×2 mean",
        source=source,
        bytes_written=dst.nbytes,
        ours=lambda: _native.box_reduce(source, dst, (2, 2, 2)),
        peers={
            # Its axes are x, y, z in Fortran order: the same bytes.
            "tinybrain": lambda: tinybrain.downsample_with_averaging(source.T, (2, 2, 2)),
            "SimpleITK BinShrink": lambda: SimpleITK.BinShrink(image, (2, 2, 2)),
            **(more_peers or {}),
        },
    )


def _minmax(source: NDArray[np.generic], block: int = 16) -> Contest:
    shape = _native.block_minmax_shape(source.shape, block)
    low, high = np.empty(shape, source.dtype), np.empty(shape, source.dtype)
    # NumPy gets the easier task: whole blocks only, no shared voxels.
    z, y, x = (n // block for n in source.shape)
    blocks = source[: z * block].reshape(z, block, y, block, x, block)
    return Contest(
        work=f"{block}³ block min and max",
        source=source,
        bytes_written=low.nbytes + high.nbytes,
        ours=lambda: _native.block_minmax(source, block, low, high),
        peers={"numpy reshape": lambda: (blocks.min(axis=(1, 3, 5)), blocks.max(axis=(1, 3, 5)))},
    )


def _quantize(source: NDArray[np.generic]) -> Contest:
    codes = np.empty(source.shape, np.uint8)
    histogram = np.zeros(256, np.uint64)
    low, high = WINDOW
    image = SimpleITK.GetImageFromArray(source)

    # The peers give the codes only: no histogram, no error.
    def with_numpy() -> object:
        scaled = source * np.float32(255 / (high - low))
        scaled -= np.float32(low * 255 / (high - low))
        return np.rint(scaled.clip(0, 255)).astype(np.uint8)

    return Contest(
        work="quantise, histogram, error",
        source=source,
        bytes_written=codes.nbytes,
        ours=lambda: _native.quantize(source, 1.0, 0.0, low, high, codes, histogram),
        peers={
            "numpy clip, rint": with_numpy,
            "SimpleITK IntensityWindowing": lambda: SimpleITK.Cast(
                SimpleITK.IntensityWindowing(image, low, high, 0, 255), SimpleITK.sitkUInt8
            ),
        },
    )


def _stored_values(source: NDArray[np.generic]) -> Iterator[Contest]:
    yield _planes(source)
    if source.dtype == np.float32:
        yield _range(source)


def _planes(source: NDArray[np.generic]) -> Contest:
    depth, height, width = source.shape
    tables = [np.empty((depth, n), source.dtype) for n in (height, height, width, width)]

    def numpy() -> object:
        # Never along x, which takes NumPy several times as long.
        low, high = source.min(axis=0), source.max(axis=0)
        return source.min(axis=1).min(axis=1), source.max(axis=1).max(axis=1), low.min(axis=1), high.max(axis=1)

    return Contest(
        work="range of each plane",
        source=source,
        bytes_written=sum(table.nbytes for table in tables),
        ours=lambda: _native.slice_ranges(source, *tables),
        peers={"numpy min, max": numpy},
    )


def _range(source: NDArray[np.generic]) -> Contest:
    return Contest(
        work="range of finite values",
        source=source,
        bytes_written=0,
        ours=lambda: _native.value_range(source),
        peers={"numpy nanmin, nanmax": lambda: (np.nanmin(source), np.nanmax(source))},
    )
