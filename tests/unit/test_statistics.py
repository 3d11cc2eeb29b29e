import numpy as np
import pytest

from volprep.scan import slabs, statistics
from volprep.scan.statistics import measure, measure_again
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.package.channel import SourceRecord
from volprep_formats.progress import Silent
from volprep_formats.source import SourceInfo


class InMemory:
    """A source of an array."""

    def __init__(self, voxels, slope=1.0, intercept=0.0, spacing=(1.0, 1.0, 1.0), remarks=()):
        self._voxels = voxels
        self.info = SourceInfo(
            format="raw",
            grid=Grid.of(voxels.shape, spacing),
            stored_type=voxels.dtype.name,
            slope=slope,
            intercept=intercept,
            remarks=remarks,
        )

    def read_slab(self, z0, z1):
        return self._voxels[z0:z1]

    def __enter__(self):
        return self

    def __exit__(self, *exception):
        pass


def voxels(dtype=np.int16, shape=(7, 5, 33)):
    return np.random.default_rng(5).integers(-100 if np.dtype(dtype).kind != "u" else 0, 90, shape).astype(dtype)


@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.uint16, np.float32])
@pytest.mark.parametrize("slope", [2.0, -0.5])
def test_the_range_is_physical(dtype, slope) -> None:
    stored = voxels(dtype)
    found = measure(InMemory(stored, slope, 3.0), Silent()).statistics
    physical = stored.astype(float) * slope + 3.0
    assert (found.minimum, found.maximum, found.non_finite) == (physical.min(), physical.max(), 0)


def test_slabs_leave_no_trace(monkeypatch) -> None:
    whole = measure(InMemory(voxels()), Silent())
    monkeypatch.setattr(slabs, "SLAB_BYTES", 700)
    pieces = measure(InMemory(voxels()), Silent())
    assert pieces.sha256 == whole.sha256
    assert pieces.statistics == whole.statistics
    assert all(np.array_equal(*pair) for pair in zip(pieces.rays_zyx, whole.rays_zyx, strict=True))


def test_the_digest_names_values_and_geometry_and_nothing_else() -> None:
    def digest(source):
        return measure(source, Silent()).sha256

    same = digest(InMemory(voxels()))
    assert digest(InMemory(voxels(), remarks=("one ignored file",))) == same
    changed = voxels()
    changed[3, 2, 1] += 1
    others = [
        InMemory(changed),
        InMemory(voxels(), slope=2.0),
        InMemory(voxels(), intercept=1.0),
        InMemory(voxels(), spacing=(1.0, 1.0, 1.5)),
        InMemory(voxels().reshape(5, 7, 33)),
        InMemory(voxels().astype(np.float32)),
    ]
    assert len({same, *(digest(other) for other in others)}) == len(others) + 1


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_voxels_that_are_no_numbers_are_refused_with_their_place(monkeypatch, bad) -> None:
    stored = voxels(np.float32)
    stored[4, 1, 2] = stored[6, 0, 0] = bad
    monkeypatch.setattr(slabs, "SLAB_BYTES", 1400)
    with pytest.raises(VolprepError, match=r"VP1090 the source has 2 voxels that are NaN or infinite, .* slice 4"):
        measure(InMemory(stored), Silent())


def test_the_sample_of_rays_is_the_same_from_the_working_data(tmp_path) -> None:
    stored = voxels(shape=(9, 70, 41))
    source = InMemory(stored, 0.5, -3.0)
    stored.tofile(tmp_path / "level0.raw")
    raw = slabs.RawVolume(tmp_path / "level0.raw", stored.shape, stored.dtype)
    first = measure(source, Silent())
    again = measure_again(SourceRecord(info=source.info, sha256=first.sha256), first.statistics, raw)
    assert [rays.shape for rays in again.rays_zyx] == [(9, 24 * 24), (70, 9 * 16), (41, 9 * 16)]
    assert all(np.array_equal(*pair) for pair in zip(again.rays_zyx, first.rays_zyx, strict=True))
    assert all(np.array_equal(*pair) for pair in zip(again.ranges_zyx, first.ranges_zyx, strict=True))
    assert (again.statistics, again.sha256) == (first.statistics, first.sha256)


def test_rays_run_along_each_axis_through_the_whole_scan(monkeypatch) -> None:
    stored = voxels(shape=(5, 7, 6))
    monkeypatch.setattr(slabs, "SLAB_BYTES", 200)
    found = measure(InMemory(stored, -0.5, 3.0), Silent()).rays_zyx
    physical = stored * -0.5 + 3.0
    # So small a scan is its own sample.
    for axis, rays in enumerate(found):
        expected = np.moveaxis(physical, axis, 0).reshape(stored.shape[axis], -1)
        assert np.array_equal(np.sort(rays, axis=1), np.sort(expected, axis=1))


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_samples_of_an_axis_eight_times_as_long_take_no_more_than_thrice_the_memory(monkeypatch, axis) -> None:
    monkeypatch.setattr(statistics, "_LONG", 64)

    def sample_bytes(length):
        shape = np.insert([24, 24], axis, length)
        found = measure(InMemory(voxels(shape=shape)), Silent())
        assert found.rays_zyx[axis].shape[0] == length
        return found.rays_zyx[axis].nbytes + found.pairs_zyx[axis].nbytes + found.stored_patches.nbytes * (axis == 0)

    assert sample_bytes(512) < 3 * sample_bytes(64)


@pytest.mark.parametrize("slope", [2.0, -0.5])
def test_every_plane_across_an_axis_has_its_physical_range(slope, monkeypatch) -> None:
    stored = voxels()
    monkeypatch.setattr(slabs, "SLAB_BYTES", 700)
    found = measure(InMemory(stored, slope, 3.0), Silent()).ranges_zyx
    physical = stored.astype(float) * slope + 3.0
    for axis, others in enumerate(((1, 2), (0, 2), (0, 1))):
        expected = np.column_stack([physical.min(axis=others), physical.max(axis=others)])
        assert np.array_equal(found[axis], expected)


@pytest.mark.parametrize("length", [1, 2, 3, 17, 24, 25, 49, 100])
def test_patches_of_scans_of_any_width_lie_inside_apart_and_are_not_empty(length) -> None:
    stored = voxels(np.uint8, (3, length, 5))
    stored[:] = np.arange(length)[:, None]
    patches = measure(InMemory(stored), Silent()).stored_patches[:, 0, :, 0]
    assert patches.shape == (min(3, max(1, length // 24)), min(length, 24))
    found = patches.ravel()
    assert len(np.unique(found)) == len(found)
    assert (np.diff(patches, axis=1) == 1).all()
