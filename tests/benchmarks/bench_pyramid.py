"""Filters of the pyramid, 2×2×2, beside the box filter and what SciPy and others take for the same work.

All run in turn in one contest, on all threads: what counts is a filter's rate as a part of the box filter's.

The box is limited by memory, the others by arithmetic. Of bytes, in processor time of one core with AVX2 (EPYC, 3.1
GHz): a box of 2×2×2 takes 0.07 ns a voxel, at 15 GB/s; at 30 % of that a voxel may take 0.22 ns, 0.7 cycles. A filter
of n weights along each axis needs n · (1/2 + 1/4 + 1/8) multiplications and additions a voxel: 5.25 for the Gaussian,
which is at 31 to 33 % of the box, and 8.75 for Lanczos-3, about 3 instructions on vectors of 16 and 8 numbers: 0.65 ns,
12 to 13 % of the box. Almost half of that is the pass along z, which widens every byte.

AVX2 can multiply bytes and add neighbours without widening, along x; with that pass first, y next and z last, from a
ring of slices in the L2 cache, a volume that fits the cache took 0.29 instead of 0.38 ns for Lanczos-3 without its
clamp and 0.21 instead of 0.22 for the Gaussian, but 0.17 instead of 0.15 for the binomial, 0.13 instead of 0.09 for
bilinear, and floats took 1.7 times as long: what is saved in instructions goes into rows that are stored and read
again. Two or four slices of the level at a time, so that rows are read once for all of them, took bytes 10 to 30 %
longer. Wider types have fewer numbers in a vector, but so has the box: Lanczos-3 is at 19 to 22 % for 16 bits and at 23
to 31 % for floats, whose pass along z converts every voxel five times.
"""

import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tinybrain
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from scipy import ndimage

from volprep.parts.levels.noise import noise_of
from volprep.parts.levels.reduce import reduced
from volprep.scan.slabs import RawVolume
from volprep_formats.package.channel import LevelFilter

from .contest import best_ms

FACTORS = (2, 2, 2)
FILTERS: tuple[LevelFilter, ...] = (
    "box",
    "nearest",
    "bilinear",
    "binomial",
    "gaussian",
    "lanczos3",
    "minimum",
    "maximum",
    "median",
    "feature-preserving",
)
SHAPE = (192, 512, 512)
NOISE = 20.0


@dataclass(frozen=True)
class FilterRow:
    """One filter."""

    filter: str
    """Its name."""
    voxels: str
    """Type and shape."""
    ours_ms: float
    """Best time."""
    of_box: float
    """Its rate as a part of the box filter's."""
    peer: str
    """Who else does something equivalent, or nothing."""
    peer_ms: float | None
    """Its best time."""


def measure_pyramid(console: Console) -> Iterator[FilterRow]:
    """Measure every filter on bytes, 16 bits and floats, and label filters on labels."""
    rng = np.random.default_rng(1)
    scan = rng.normal(120, 25, SHAPE).clip(1, 255).astype(np.uint8)
    for dtype in (np.uint8, np.uint16, np.float32):
        volume = scan[:: np.dtype(dtype).itemsize].astype(dtype)
        console.print(f"measuring filters of the pyramid, {volume.dtype}", style="dim")
        runs: dict[str, Run] = {name: _run(volume, name) for name in FILTERS}
        peers = _peers(volume) if dtype == np.uint8 else {}
        with tempfile.TemporaryDirectory() as folder:
            if dtype != np.float32:
                runs |= _with_noise(volume, Path(folder))
            yield from _rows(volume, runs, peers)
    labels = np.zeros(SHAPE, np.uint8)
    labels[40:150, 90:400, 100:300] = 3
    labels[60:, 200:, 250:] = 7
    console.print("measuring filters of labels", style="dim")
    runs = {name: _run(labels, name) for name in ("box", "mode", "mode-foreground")}
    peer = ("tinybrain", lambda: tinybrain.downsample_segmentation(labels.T, FACTORS))
    yield from _rows(labels, runs, {"mode": peer})[1:]


def pyramid_table(rows: list[FilterRow]) -> Table:
    """Show them."""
    table = Table("filter, 2×2×2", "voxels", "ours ms", "of box", "peer", "peer ms", "ratio")
    for column in (2, 3, 5, 6):
        table.columns[column].justify = "right"
    for row in rows:
        peer = ("", "") if row.peer_ms is None else (f"{row.peer_ms:.0f}", f"{row.peer_ms / row.ours_ms:.0f} ×")
        table.add_row(row.filter, row.voxels.split()[0], f"{row.ours_ms:.1f}", f"{row.of_box:.0%}", row.peer, *peer)
    return table


Run = Callable[[], object]
Peer = tuple[str, Run]


def _run(volume: NDArray[np.generic], name: LevelFilter) -> Run:
    return lambda: reduced(volume, FACTORS, name, NOISE)


def _with_noise(volume: NDArray[np.generic], folder: Path) -> dict[str, Run]:
    """The noise that the filter asks for, which is read from the working data, and both together."""
    path = folder / "volume.raw"
    volume.tofile(path)
    source = RawVolume(path, volume.shape, volume.dtype)
    return {
        "noise, once for all levels": lambda: noise_of(source),
        "feature-preserving and noise": lambda: reduced(volume, FACTORS, "feature-preserving", noise_of(source)),
    }


def _rows(volume: NDArray[np.generic], runs: dict[str, Run], peers: dict[str, Peer]) -> list[FilterRow]:
    contestants = {**runs, **{f"peer of {name}": run for name, (_, run) in peers.items()}}
    best = best_ms(contestants, rounds=7)
    voxels = f"{volume.dtype} {'×'.join(map(str, volume.shape))}"
    return [
        FilterRow(
            filter=name,
            voxels=voxels,
            ours_ms=best[name],
            of_box=best["box"] / best[name],
            peer=peers[name][0] if name in peers else "",
            peer_ms=best.get(f"peer of {name}"),
        )
        for name in runs
    ]


def _peers(volume: NDArray[np.generic]) -> dict[str, Peer]:
    """Equivalents of SciPy: they filter the whole volume, of which every second voxel is then taken."""
    small = volume[:32]
    scale = len(volume) / len(small)

    def repeated(run: Run) -> Run:
        # A sixth of the volume, six times: the whole would take a minute for each.
        return lambda: [run() for _ in range(round(scale))]

    def feature_preserving() -> None:
        base = small.astype(np.float32)
        for axis in range(3):
            base = ndimage.correlate1d(base, [0.125, 0.375, 0.375, 0.125], axis)
        low, high = ndimage.minimum_filter(small, 2), ndimage.maximum_filter(small, 2)
        base, low, high = (each[1::2, 1::2, 1::2] for each in (base, low, high))
        deviation = np.where(high - base >= base - low, high - base, low - base)
        t = np.clip((np.abs(deviation) / NOISE - 3) / 3, 0, 1)
        np.rint(base + t * t * (3 - 2 * t) * deviation).astype(np.uint8)

    def gaussian() -> None:
        np.rint(ndimage.gaussian_filter(small.astype(np.float32), 1.0)[1::2, 1::2, 1::2]).astype(np.uint8)

    return {
        "box": ("tinybrain", lambda: tinybrain.downsample_with_averaging(volume.T, FACTORS)),
        "gaussian": ("scipy gaussian_filter", repeated(gaussian)),
        "median": ("scipy median_filter", repeated(lambda: ndimage.median_filter(small, 2)[1::2, 1::2, 1::2])),
        "maximum": ("scipy maximum_filter", repeated(lambda: ndimage.maximum_filter(small, 2)[1::2, 1::2, 1::2])),
        "feature-preserving": ("scipy, four filters", repeated(feature_preserving)),
    }
