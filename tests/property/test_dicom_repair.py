"""Random uneven and tilted series: after the repair every voxel is the field at the place where the grid puts it."""

import math
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from dicom_files import image, save
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from long_runs import share_of
from numpy.typing import NDArray

from volprep.scan.repair import open_scan
from volprep_formats.progress import Silent
from volprep_formats.source import SourceInfo, SourceSpec

AMPLITUDE = 100.0
ROUNDING = 1e-4
"""Positions have ten decimals, values 24 bits: far less than this."""


@dataclass(frozen=True)
class Series:
    """Slices of the field AMPLITUDE · sin(wave · world), wherever they lie."""

    axes: NDArray[np.float64]
    """Columns: along a row, along a column, and their cross product."""
    origin_mm: NDArray[np.float64]
    spacing_mm_xy: NDArray[np.float64]
    shape_xy: tuple[int, int]
    along_mm: NDArray[np.float64]
    """Where each slice lies along the normal, ascending from 0."""
    drift_xy: NDArray[np.float64]
    """How far slices move along rows and columns for each millimetre along the normal."""
    wave: NDArray[np.float64]

    def field(self, world: NDArray[np.float64]) -> NDArray[np.float64]:
        return AMPLITUDE * np.sin(world @ self.wave)

    def start_mm(self, along_mm: float) -> NDArray[np.float64]:
        """World position of the first pixel of a slice."""
        return self.origin_mm + self.axes @ [*(self.drift_xy * along_mm), along_mm]

    def save(self, folder: Path, seed: int) -> None:
        y, x = np.indices(self.shape_xy[::-1])
        for along, name in zip(self.along_mm, np.random.default_rng(seed).permutation(len(self.along_mm)), strict=True):
            steps = np.stack([x * self.spacing_mm_xy[0], y * self.spacing_mm_xy[1], np.zeros_like(x)], axis=-1)
            world = self.start_mm(along) + steps @ self.axes.T
            data = image(
                np.zeros_like(x, np.int16),
                self.start_mm(along),
                orientation=self.axes[:, :2].T,
                spacing_mm_yx=self.spacing_mm_xy[::-1],
                BitsAllocated=32,
            )
            del data.PixelData
            data.FloatPixelData = self.field(world).astype("<f4").tobytes()
            save(data, folder / f"{name:03d}")

    def is_covered(self, world: NDArray[np.float64]) -> bool:
        """Whether the slices on both sides reach to the place, so that no padding is mixed in."""
        x, y, along = self.axes.T @ (world - self.origin_mm)
        above = int(np.searchsorted(self.along_mm, along - 1e-6))
        below = above if above < len(self.along_mm) and abs(self.along_mm[above] - along) <= 1e-6 else above - 1
        for k in (below, above):
            pixel = (np.array([x, y]) - self.drift_xy * self.along_mm[k]) / self.spacing_mm_xy
            if not ((pixel > -1e-6) & (pixel < np.array(self.shape_xy) - 1 + 1e-6)).all():
                return False
        return True

    def largest_error(self, info: SourceInfo) -> float:
        """How wrong linear interpolation can be: h²/8 · the largest second derivative, along each axis.

        What is within the tolerances of a grid is taken as one, and then off by the place times the first derivative.
        """
        first = AMPLITUDE * np.abs(self.axes.T @ self.wave)
        second = AMPLITUDE * (self.axes.T @ self.wave) ** 2
        steps_mm = np.array([*self.spacing_mm_xy, np.diff(self.along_mm).max()])
        shifts_mm = np.abs(self.drift_xy) * self.along_mm[-1]
        off_mm = np.where(shifts_mm <= 0.1 * self.spacing_mm_xy + 1e-9, shifts_mm, 0.0)
        even_mm = np.linspace(0.0, self.along_mm[-1], len(self.along_mm))
        kinds = {repair.kind for repair in info.repairs}
        uneven_mm = 0.0 if "gaps" in kinds else np.abs(self.along_mm - even_mm).max()
        return float(second @ steps_mm**2 / 8 + first @ [*off_mm, uneven_mm]) + ROUNDING


@st.composite
def damaged_series(draw: st.DrawFn) -> Series:
    numbers = st.lists(st.floats(-1, 1), min_size=9, max_size=9)
    axes = np.linalg.qr(np.array(draw(numbers)).reshape(3, 3) + np.eye(3) * 3)[0]
    axes = axes[:, draw(st.permutations(range(3)))] * [draw(st.sampled_from((-1, 1))) for _ in range(3)]
    axes[:, 2] = np.cross(axes[:, 0], axes[:, 1])
    pitch = draw(st.floats(0.5, 5.0))
    gap = st.one_of(st.just(1.0), st.sampled_from((1.0, 2.0, 3.0)), st.floats(0.5, 2.0))
    gaps = draw(st.lists(gap, min_size=3, max_size=9))
    tilt_deg = [draw(st.one_of(st.just(0.0), st.floats(-35.0, 35.0))) for _ in range(2)]
    return Series(
        axes=axes,
        origin_mm=np.array([draw(st.floats(-300, 300)) for _ in range(3)]),
        spacing_mm_xy=np.array([draw(st.floats(0.3, 3.0)) for _ in range(2)]),
        shape_xy=(draw(st.integers(9, 24)), draw(st.integers(9, 24))),
        along_mm=np.concatenate(([0.0], np.cumsum(gaps))) * pitch,
        drift_xy=np.tan(np.radians(tilt_deg)),
        wave=np.array([draw(st.floats(-0.15, 0.15)) for _ in range(3)]),
    )


@pytest.mark.longer
@settings(max_examples=share_of(60, 3))
@given(damaged_series(), st.integers(0, 2**32))
def test_every_voxel_that_slices_cover_is_the_field_at_its_place(series: Series, seed: int) -> None:
    # A repair that makes four times as many rows or columns is refused, and a test of its own.
    grown = np.abs(series.drift_xy) * series.along_mm[-1] / series.spacing_mm_xy
    assume((grown < 2.5 * np.array(series.shape_xy)).all())
    with tempfile.TemporaryDirectory() as folder:
        series.save(Path(folder), seed)
        spec = SourceSpec(path=folder, repair=("gaps", "tilt"))
        with open_scan(spec, Path(), Silent()) as source:
            info = source.info
            voxels = source.read_slab(0, info.grid.shape_zyx[0])
    chance = np.random.default_rng(seed)
    index_zyx = chance.integers(0, voxels.shape, (300, 3))
    index = np.column_stack((index_zyx[:, ::-1], np.ones(len(index_zyx))))
    world = (index @ info.grid.world_from_index.T)[:, :3]
    error = np.abs(voxels[tuple(index_zyx.T)] - series.field(world))
    covered = np.array([series.is_covered(place) for place in world])
    assert (error[covered] <= series.largest_error(info)).all()
    # What the slices fill of the box that grew around them, less what lies between two of them near their edges.
    steps = np.diff(series.along_mm).max() * np.abs(series.drift_xy) / series.spacing_mm_xy
    share = math.prod(((np.array(series.shape_xy) - steps - 1).clip(0) / np.array(voxels.shape[:0:-1])).tolist())
    assert covered.mean() >= share - 4 * math.sqrt(0.25 / len(covered))
