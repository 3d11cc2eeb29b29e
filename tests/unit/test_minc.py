"""MINC 1 and 2: values, places and what is refused; nibabel's own test files are read as nibabel reads them."""

import gzip
import importlib.util
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

import h5py
import nibabel
import numpy as np
import pytest
from minc_files import NAMES, minc1, minc2
from nibabel.testing import data_path

from volprep_formats.diagnostics import VolprepError
from volprep_formats.isolation import workers
from volprep_formats.progress import Silent
from volprep_formats.readers import format_of, open_source
from volprep_formats.source import SourceInfo, SourceSpec

SHAPE = (3, 5, 7)
Write = Callable[..., Path]


@pytest.fixture(scope="module", autouse=True)
def _one_pool() -> Iterator[None]:
    """Keep the worker processes from test to test: each costs a second to start."""
    with workers():
        yield


both = pytest.mark.parametrize("write", [minc1, minc2])


def noise(dtype: str = "int16", shape: tuple[int, ...] = SHAPE) -> np.ndarray:
    return np.random.default_rng(3).integers(0, 100, shape).astype(dtype)


def read(path: Path, volume: int | None = None) -> tuple[np.ndarray, SourceInfo]:
    """Physical values, in two slabs, and the description."""
    with open_source(SourceSpec(path=str(path), volume=volume), Path("/"), Silent()) as source:
        info = source.info
        depth = info.grid.shape_zyx[0]
        stored = np.concatenate([source.read_slab(0, 1), source.read_slab(1, depth)])
        assert stored.dtype.name == info.stored_type
        return stored * info.slope + info.intercept, info


def refused(path: Path, **told: int) -> VolprepError:
    with pytest.raises(VolprepError) as caught:
        read(path, **told)
    return caught.value


@pytest.mark.parametrize("path", sorted(Path(data_path).glob("*.mnc")), ids=lambda path: path.stem)
def test_published_files_are_read_as_nibabel_reads_them(path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of a spacing that contradicts itself
        known = nibabel.load(path)
        values = np.asarray(known.dataobj)
    several = values.ndim == 4
    found, info = read(path, volume=2 if several else None)
    np.testing.assert_allclose(found, values[1] if several else values, rtol=1e-6)
    ras = np.eye(4)
    ras[:3, :3] = np.array(info.grid.direction) * np.array(info.grid.spacing_mm_zyx)[::-1]
    ras[:3, 3] = info.grid.origin_mm_xyz
    ras[:2] *= -1
    # The file's axes are z, y, x.
    np.testing.assert_allclose(ras[:, [2, 1, 0, 3]], known.affine, atol=1e-9)


@both
@pytest.mark.parametrize("dtype", ["uint8", "int8", "int16", "uint16", "int32", "float32", "float64"])
def test_integers_with_one_range_are_kept_as_stored(tmp_path: Path, write: Write, dtype: str) -> None:
    voxels = noise(dtype)
    path = write(tmp_path / "a.mnc", voxels, -50.0, 50.0, image__valid_range=(0.0, 100.0))
    assert format_of(path) == "minc"
    found, info = read(path)
    np.testing.assert_allclose(found, voxels - (50.0 if voxels.dtype.kind != "f" else 0.0))
    assert info.stored_type == {"uint8": "uint8", "int8": "int16", "int32": "uint8"}.get(
        dtype, dtype.replace("64", "32")
    )


@both
def test_slices_with_ranges_of_their_own_are_read_as_floats_with_a_remark(tmp_path: Path, write: Write) -> None:
    voxels, high = noise(), np.array([100.0, 200.0, 1000.0])
    path = write(tmp_path / "a.mnc", voxels, np.zeros(3), high, image__valid_range=(0.0, 100.0))
    found, info = read(path)
    np.testing.assert_allclose(found, voxels * (high / 100.0)[:, None, None], rtol=1e-6)
    assert "range of values of its own" in info.remarks[0]


@both
def test_the_grid_is_in_millimetres_of_the_patient(tmp_path: Path, write: Write) -> None:
    grid = read(write(tmp_path / "a.mnc", noise()))[1].grid
    assert grid.spacing_mm_zyx == pytest.approx((3.0, 1.5, 2.0))
    assert grid.origin_mm_xyz == pytest.approx((-5.0, -6.0, 7.0))
    np.testing.assert_allclose(np.array(grid.direction), np.diag([-1.0, 1.0, 1.0]))
    large = {f"{name}__units": b"cm" for name in NAMES}
    assert read(write(tmp_path / "b.mnc", noise(), **large))[1].grid.spacing_mm_zyx == pytest.approx((30.0, 15.0, 20.0))


@both
def test_axes_in_another_order_lie_where_the_file_says(tmp_path: Path, write: Write) -> None:
    names = ("xspace", "zspace", "yspace")
    voxels = noise()
    found, info = read(write(tmp_path / "a.mnc", voxels, 0, 65535, names=names))
    np.testing.assert_allclose(found, voxels + 32768.0)
    assert info.grid.spacing_mm_zyx == pytest.approx((2.0, 3.0, 1.5))
    np.testing.assert_allclose(np.array(info.grid.direction)[:, 2], (-1, 0, 0))


@both
@pytest.mark.parametrize("names", [("time", *NAMES), (*NAMES, "time")])
def test_one_of_several_volumes_is_chosen_by_its_number(tmp_path: Path, write: Write, names: tuple[str, ...]) -> None:
    voxels = noise("float32", (2, *SHAPE))
    stored = np.moveaxis(voxels, 0, names.index("time"))
    path = write(tmp_path / "a.mnc", np.ascontiguousarray(stored), names=names)
    np.testing.assert_array_equal(read(path, volume=2)[0], voxels[1])
    assert refused(path).code == "VP1021"


@both
@pytest.mark.parametrize("dtype", ["int16", "uint8"])
def test_values_outside_the_valid_range_become_its_ends_and_are_counted(
    tmp_path: Path, write: Write, dtype: str
) -> None:
    voxels = 2 * noise(dtype)
    path = write(tmp_path / "a.mnc", voxels, 10.0, 160.0, image__valid_range=(10.0, 160.0))
    found, info = read(path)
    np.testing.assert_allclose(found, np.clip(voxels, 10, 160))
    assert info.remarks[0].startswith(f"{((voxels < 10) | (voxels > 160)).sum()} voxels lie outside")


def test_a_gzipped_file_is_read(tmp_path: Path) -> None:
    voxels = noise("float32")
    path = tmp_path / "a.mnc.gz"
    path.write_bytes(gzip.compress(minc1(tmp_path / "a.mnc", voxels).read_bytes()))
    np.testing.assert_array_equal(read(path)[0], voxels)


def test_minc_is_known_by_its_first_bytes_under_another_name(tmp_path: Path) -> None:
    assert format_of(minc1(tmp_path / "a.nc", noise())) == "minc"
    assert format_of(minc2(tmp_path / "a.h5", noise())) == "minc"


@both
@pytest.mark.parametrize(
    ("odd", "code"),
    [
        ({"xspace__units": b"furlong"}, "VP2021"),
        ({"xspace__step": 0.0}, "VP2021"),
        ({"xspace__step": np.nan}, "VP2021"),
        ({"xspace__direction_cosines": (2.0, 0.0, 0.0)}, "VP2021"),
        ({"xspace__direction_cosines": (1.0,)}, "VP1304"),
        ({"xspace__direction_cosines": (0.9, np.sqrt(0.19), 0.0)}, "VP2020"),
        ({"zspace__spacing": b"irregular"}, "VP1304"),
        ({"image__valid_range": (60.0, 10.0)}, "VP1304"),
        ({"image__valid_range": (0.0, 1e6)}, "VP1304"),
    ],
    ids=str,
)
def test_a_header_that_gives_no_grid_or_no_values_is_refused(
    tmp_path: Path, write: Write, odd: dict[str, object], code: str
) -> None:
    assert refused(write(tmp_path / "a.mnc", noise(), **odd)).code == code


@both
def test_colours_are_refused_by_the_name_of_their_axis(tmp_path: Path, write: Write) -> None:
    voxels = noise("uint8", (*SHAPE, 3))
    error = refused(write(tmp_path / "a.mnc", voxels, names=(*NAMES, "vector_dimension")))
    assert error.code == "VP1304"
    assert "vector_dimension" in str(error)


def test_blocks_that_were_never_written_are_refused(tmp_path: Path) -> None:
    path = minc2(tmp_path / "a.mnc", noise())
    with h5py.File(path, "a") as file:
        folder = file["minc-2.0/image/0"]
        del folder["image"]
        image = folder.create_dataset("image", SHAPE, "int16", chunks=(1, 5, 7))
        image[:2] = 1
        image.attrs["dimorder"] = np.bytes_(",".join(NAMES))
    assert "1 of 3 blocks" in str(refused(path))


@pytest.mark.parametrize("name", ["minc-2.0/image/0/image", "minc-2.0/dimensions/xspace", "minc-2.0/image"])
def test_links_to_other_files_are_refused(tmp_path: Path, name: str) -> None:
    minc2(tmp_path / "other.mnc", noise())
    path = minc2(tmp_path / "a.mnc", noise())
    with h5py.File(path, "a") as file:
        del file[name]
        file[name] = h5py.ExternalLink(str(tmp_path / "other.mnc"), name)
    assert "links to other files" in str(refused(path))


def test_voxels_in_another_file_are_refused(tmp_path: Path) -> None:
    secret = tmp_path / "secret"
    secret.write_bytes(noise().tobytes())
    path = minc2(tmp_path / "a.mnc", noise())
    with h5py.File(path, "a") as file:
        folder = file["minc-2.0/image/0"]
        del folder["image"]
        image = folder.create_dataset("image", SHAPE, "int16", external=[(str(secret), 0, h5py.h5f.UNLIMITED)])
        image.attrs["dimorder"] = np.bytes_(",".join(NAMES))
    assert "links to other files" in str(refused(path))


def test_minc_2_without_h5py_names_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    find = importlib.util.find_spec
    monkeypatch.setattr(
        "volprep_formats.readers.minc.reader.find_spec", lambda name: None if name == "h5py" else find(name)
    )
    error = refused(minc2(tmp_path / "a.mnc", noise()))
    assert error.code == "VP1305"
    assert "[minc]" in str(error)


@pytest.mark.parametrize("write", [minc1, minc2])
def test_ends_of_values_whose_distance_is_infinite_are_refused(tmp_path, write) -> None:
    path = write(tmp_path / "a.mnc", np.arange(60, dtype=np.int16).reshape(3, 4, 5), low=-1.5e308, high=1.5e308)
    with pytest.raises(VolprepError) as error:
        open_source(SourceSpec(path=str(path)), Path(), Silent())
    assert error.value.code == "VP1304"
