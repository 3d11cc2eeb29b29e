"""Random DICOM series: every voxel must lie where its slice's attributes put it, whatever the names of the files."""

import math
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from dicom_files import image, save
from hypothesis import given, settings
from hypothesis import strategies as st
from long_runs import share_of
from numpy.typing import NDArray

from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.source import SourceSpec, VolumeSource

SPACING = st.floats(0.05, 12.0)
POSITION = st.floats(-800.0, 800.0)


@dataclass(frozen=True)
class Series:
    """A series in the words of its attributes: positions of the first pixel, slice by slice."""

    shape_zyx: tuple[int, int, int]
    spacing_mm_yx: tuple[float, float]
    rows_and_columns: NDArray[np.float64]
    positions_mm: NDArray[np.float64]
    seed: int

    def save(self, folder: Path) -> None:
        nz, ny, nx = self.shape_zyx
        values = np.arange(nz * ny * nx, dtype=np.uint16).reshape(self.shape_zyx)
        names = np.random.default_rng(self.seed).permutation(nz)
        for z in range(nz):
            data = image(
                values[z],
                self.positions_mm[z],
                orientation=self.rows_and_columns,
                spacing_mm_yx=self.spacing_mm_yx,
                SliceThickness="7.7",
                SpacingBetweenSlices="7.7",
            )
            save(data, folder / f"{names[z]:04d}")

    def world_mm(self, value: int) -> NDArray[np.float64]:
        """Position of the voxel that holds `value`, from DICOM's equation (PS3.3, C.7.6.2.1.1)."""
        z, y, x = np.unravel_index(value, self.shape_zyx)
        row, column = self.rows_and_columns
        return self.positions_mm[z] + row * self.spacing_mm_yx[1] * x + column * self.spacing_mm_yx[0] * y


@st.composite
def straight_series(draw: st.DrawFn, *, fewest: int = 2) -> tuple[Series, NDArray[np.float64], float]:
    """A series on a grid, rising or falling, with its normal and the distance of its slices."""
    shape = (draw(st.integers(fewest, 9)), draw(st.integers(1, 6)), draw(st.integers(1, 6)))
    turn = np.linalg.qr(
        np.array(draw(st.lists(st.floats(-1, 1), min_size=9, max_size=9))).reshape(3, 3) + np.eye(3) * 3
    )[0]
    axes = turn[:, draw(st.permutations(range(3)))] * [draw(st.sampled_from((-1, 1))) for _ in range(3)]
    normal = np.cross(axes[:, 0], axes[:, 1])
    pitch = draw(SPACING)
    direction = normal * draw(st.sampled_from((-1, 1)))
    origin = np.array([draw(POSITION) for _ in range(3)])
    positions = origin + np.arange(shape[0])[:, None] * pitch * direction
    series = Series(shape, (draw(SPACING), draw(SPACING)), axes[:, :2].T, positions, draw(st.integers(0, 2**32)))
    return series, direction, pitch


def open_series(series: Series, folder: Path) -> VolumeSource:
    series.save(folder)
    return open_source(SourceSpec(path="."), folder, Silent())


@pytest.mark.longer
@settings(max_examples=share_of(120, 3))
@given(straight_series(fewest=2))
def test_every_voxel_lies_where_its_attributes_put_it(drawn: tuple[Series, NDArray[np.float64], float]) -> None:
    series, _, pitch = drawn
    with tempfile.TemporaryDirectory() as folder, open_series(series, Path(folder)) as source:
        grid = source.info.grid
        voxels = source.read_slab(0, grid.shape_zyx[0])
    assert grid.shape_zyx == series.shape_zyx
    assert sorted(voxels.ravel()) == list(range(voxels.size))
    z, y, x = np.indices(grid.shape_zyx)
    world = np.stack([x, y, z, np.ones_like(x)], axis=-1) @ grid.world_from_index.T
    expected = np.stack([series.world_mm(value) for value in voxels.ravel()]).reshape(*voxels.shape, 3)
    # Cosines of 16 characters are off by 5e-14 at most, so a slab of 6 × 12 mm shifts by far less than this.
    assert np.abs(world[..., :3] - expected).max() < 1e-6
    assert np.linalg.det(grid.direction) == pytest.approx(1.0)
    assert grid.spacing_mm_zyx[0] == pytest.approx(pitch, abs=1e-9)


@settings(max_examples=40)
@given(straight_series(fewest=5), st.data())
def test_a_missing_slice_is_refused_with_its_gap(
    drawn: tuple[Series, NDArray[np.float64], float], data: st.DataObject
) -> None:
    series, _, pitch = drawn
    gone = data.draw(st.integers(1, series.shape_zyx[0] - 2))
    kept = [z for z in range(series.shape_zyx[0]) if z != gone]
    holed = Series(
        (len(kept), *series.shape_zyx[1:]),
        series.spacing_mm_yx,
        series.rows_and_columns,
        series.positions_mm[kept],
        series.seed,
    )
    with tempfile.TemporaryDirectory() as folder, pytest.raises(VolprepError) as error:
        open_series(holed, Path(folder))
    assert error.value.code == "VP2014"
    assert error.value.fields["missing"] == 1
    assert error.value.fields["gap_mm"] == pytest.approx(2 * pitch, abs=1e-6)
    assert error.value.fields["usual_mm"] == pytest.approx(pitch, abs=1e-6)


@settings(max_examples=40)
@given(straight_series(fewest=3), st.floats(2.0, 40.0), st.sampled_from((-1, 1)), st.sampled_from((0, 1)))
def test_a_tilt_is_refused_with_its_angle(
    drawn: tuple[Series, NDArray[np.float64], float], angle_deg: float, sign: int, axis: int
) -> None:
    series, direction, pitch = drawn
    shift = math.tan(math.radians(angle_deg)) * pitch
    # Less than a tenth of a pixel over the whole stack passes for rounding.
    spacing = min(5.0, shift * (series.shape_zyx[0] - 1))
    along = np.cross(*series.rows_and_columns) @ direction
    beside = series.rows_and_columns[axis] * shift * sign * along
    tilted = Series(
        series.shape_zyx,
        (spacing, spacing),
        series.rows_and_columns,
        series.positions_mm + np.arange(series.shape_zyx[0])[:, None] * beside,
        series.seed,
    )
    with tempfile.TemporaryDirectory() as folder, pytest.raises(VolprepError) as error:
        open_series(tilted, Path(folder))
    assert error.value.code == "VP2007"
    assert f"{sign * angle_deg:.2f}° about the {'rows' if axis else 'columns'}" == error.value.fields["angles"]
    assert error.value.fields["pitch_mm"] == pytest.approx(pitch, abs=1e-6)
    assert error.value.fields["step_mm"] == pytest.approx(math.hypot(pitch, shift), abs=1e-6)
