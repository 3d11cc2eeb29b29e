"""Headerless raw volumes, plain and gzipped."""

import gzip
from pathlib import Path

import numpy as np
import pytest

from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.source import RawLayout, SourceSpec, VolumeSource

SHAPE = (5, 3, 7)


def voxels(dtype: str) -> np.ndarray:
    return np.random.default_rng(2).integers(0, 255, SHAPE).astype(dtype)


def open_raw(file: Path, **layout) -> VolumeSource:
    told = RawLayout(**{"shape_zyx": SHAPE, "dtype": "uint8", **layout})
    return open_source(SourceSpec(path=file.name, raw=told), file.parent, Silent())


def refusal(file: Path, **layout) -> VolprepError:
    with pytest.raises(VolprepError) as error, open_raw(file, **layout) as source:
        source.read_slab(0, SHAPE[0])
    return error.value


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("byte_order", ["little", "big"])
@pytest.mark.parametrize("dtype", ["uint8", "int16", "uint16", "float32"])
def test_voxels_are_read_in_native_order_after_the_header(tmp_path, dtype, byte_order, packed) -> None:
    values = voxels(dtype)
    data = b"head!" + values.astype(values.dtype.newbyteorder("<" if byte_order == "little" else ">")).tobytes()
    file = tmp_path / "volume.raw"
    file.write_bytes(gzip.compress(data) if packed else data)
    with open_raw(file, dtype=dtype, byte_order=byte_order, header_bytes=5) as source:
        assert source.info.stored_type == dtype
        slab = source.read_slab(0, 5)
        assert slab.dtype == np.dtype(dtype)
        assert slab.dtype.isnative
        assert np.array_equal(slab, values)


@pytest.mark.parametrize("packed", [False, True])
def test_slabs_may_be_read_in_any_order(tmp_path, packed) -> None:
    values = voxels("uint16")
    file = tmp_path / "volume"
    file.write_bytes(gzip.compress(values.tobytes()) if packed else values.tobytes())
    with open_raw(file, dtype="uint16") as source:
        for z0, z1 in [(3, 5), (0, 1), (4, 5), (1, 4), (2, 2)]:
            assert np.array_equal(source.read_slab(z0, z1), values[z0:z1])


def test_spacing_is_what_the_layout_says(tmp_path) -> None:
    file = tmp_path / "volume.raw"
    file.write_bytes(voxels("uint8").tobytes())
    with open_raw(file, spacing_mm_zyx=(3.0, 2.0, 0.5)) as source:
        assert source.info.grid.spacing_mm_zyx == (3.0, 2.0, 0.5)
        assert source.info.grid.extent_mm_zyx == (15.0, 6.0, 3.5)


@pytest.mark.parametrize(
    ("size", "layout", "hint"),
    [
        (210 - 3, {"dtype": "uint16"}, "1.5 voxels short"),
        (210, {}, "it would fit voxels of 2 byte(s), not 1"),
        (105, {"dtype": "uint16"}, "it would fit voxels of 1 byte(s), not 2"),
        (84, {}, "it would fit 4 slices, not 5"),
        (105 + 348, {}, "348 bytes too many, as if the header had 348"),
        (0, {}, "105 voxels short"),
    ],
)
def test_a_size_that_does_not_match_is_refused_with_a_hint(tmp_path, size, layout, hint) -> None:
    file = tmp_path / "volume.raw"
    file.write_bytes(bytes(size))
    error = refusal(file, **layout)
    assert error.code == "VP1011"
    assert hint in str(error)
    assert f"the file has {size}" in str(error)


def test_a_gzipped_file_that_unpacks_to_too_little_is_refused_with_both_sizes(tmp_path) -> None:
    file = tmp_path / "volume.raw.gz"
    file.write_bytes(gzip.compress(bytes(100)))
    error = refusal(file)
    assert error.code == "VP1011"
    assert "exactly 105 bytes, but the file has 100" in str(error)


def test_a_gzipped_file_that_unpacks_to_too_much_is_refused_at_its_last_slice(tmp_path) -> None:
    file = tmp_path / "volume.raw.gz"
    file.write_bytes(gzip.compress(bytes(106)))
    with open_raw(file) as source:
        source.read_slab(0, 4)
    assert refusal(file).code == "VP1011"


def test_a_size_that_no_gzip_stream_can_unpack_to_is_refused_at_once(tmp_path) -> None:
    file = tmp_path / "volume.raw.gz"
    file.write_bytes(gzip.compress(b"small"))
    with pytest.raises(VolprepError, match="VP1011"):
        open_raw(file, shape_zyx=(2**16, 2**18, 2**18), dtype="float32")


@pytest.mark.parametrize("keep", [5, 30, -6])
def test_a_cut_gzip_stream_is_refused(tmp_path, keep) -> None:
    file = tmp_path / "volume.raw.gz"
    file.write_bytes(gzip.compress(np.random.default_rng(0).bytes(105))[:keep])
    assert refusal(file).code in {"VP1011", "VP1005"}


def test_a_damaged_gzip_stream_is_refused(tmp_path) -> None:
    file = tmp_path / "volume.raw.gz"
    data = bytearray(gzip.compress(np.random.default_rng(0).bytes(105)))
    data[-7] ^= 0xFF
    file.write_bytes(data)
    assert refusal(file).code == "VP1005"


def test_a_folder_of_raw_slices_is_read_in_the_order_of_their_numbers(tmp_path) -> None:
    values = np.arange(11 * 3 * 2, dtype=">u2").reshape(11, 3, 2)
    for z, plane in enumerate(values, 1):
        (tmp_path / f"scan.{z}").write_bytes(b"head" + plane.tobytes())
    layout = {"shape_zyx": (11, 3, 2), "dtype": "uint16", "byte_order": "big", "header_bytes": 4}
    with open_raw(tmp_path, **layout) as source:
        np.testing.assert_array_equal(source.read_slab(9, 11), values[9:])
        np.testing.assert_array_equal(source.read_slab(0, 10), values[:10])
    assert refusal(tmp_path, **(layout | {"shape_zyx": (12, 3, 2)})).code == "VP1288"
    (tmp_path / "scan.4").write_bytes(b"short")
    assert "scan.4 has 5 bytes" in str(refusal(tmp_path, **layout))
    (tmp_path / "scan.4").rename(tmp_path / "scan.40")
    assert refusal(tmp_path, **layout).code == "VP1162"
