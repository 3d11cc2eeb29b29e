"""MRC and CCP4 maps: values, places in millimetres, and what is refused."""

import struct
from pathlib import Path

import numpy as np
import pytest

from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent
from volprep_formats.readers import format_of, open_source
from volprep_formats.source import SourceInfo, SourceSpec

SHAPE = (3, 5, 7)
IMOD = 1146047817
MODES = {"int8": 0, "int16": 1, "float32": 2, "uint16": 6, "float16": 12}


def write(path: Path, voxels: np.ndarray, order: str = "<", **words: tuple[int, str, tuple[float, ...]]) -> Path:
    """Write a map with voxels of 2 × 3 × 10 Å; `words` are offset, form and values that replace what stands there."""
    nz, ny, nx = voxels.shape
    head = bytearray(1024)
    struct.pack_into(order + "4i", head, 0, nx, ny, nz, MODES[voxels.dtype.name])
    struct.pack_into(order + "3i6f3i", head, 28, nx, ny, nz, 2 * nx, 3 * ny, 10 * nz, 90, 90, 90, 1, 2, 3)
    head[208:214] = b"MAP " + (b"\x44\x44" if order == "<" else b"\x11\x11")
    for offset, form, values in words.values():
        struct.pack_into(order + form, head, offset, *values)
    path.write_bytes(bytes(head) + voxels.astype(voxels.dtype.newbyteorder(order)).tobytes())
    return path


def noise(dtype: str) -> np.ndarray:
    return np.random.default_rng(3).integers(0, 100, SHAPE).astype(dtype)


def read(path: Path) -> tuple[np.ndarray, SourceInfo]:
    with open_source(SourceSpec(path=str(path)), Path("/"), Silent()) as source:
        return np.asarray(source.read_slab(0, source.info.grid.shape_zyx[0])), source.info


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("dtype", sorted(MODES))
def test_maps_of_every_mode_and_byte_order_are_read(tmp_path: Path, dtype: str, order: str) -> None:
    voxels = noise(dtype)
    path = write(tmp_path / "a.mrc", voxels, order)
    assert format_of(path) == "mrc"
    found, info = read(path)
    np.testing.assert_array_equal(found, voxels)
    assert info.grid.spacing_mm_zyx == pytest.approx((1e-6, 3e-7, 2e-7))


def test_the_origin_counts_or_else_the_start_of_the_cell(tmp_path: Path) -> None:
    moved = write(tmp_path / "a.mrc", noise("int16"), origin=(196, "3f", (10.0, 20.0, 30.0)))
    assert read(moved)[1].grid.origin_mm_xyz == pytest.approx((1e-6, 2e-6, 3e-6))
    started = write(tmp_path / "b.mrc", noise("int16"), start=(16, "3i", (1, 2, -1)))
    assert read(started)[1].grid.origin_mm_xyz == pytest.approx((2e-7, 6e-7, -1e-6))


def test_axes_in_another_order_lie_where_the_header_says(tmp_path: Path) -> None:
    path = write(tmp_path / "a.ccp4", noise("float32"), axes=(64, "3i", (3, 2, 1)))
    grid = read(path)[1].grid
    np.testing.assert_allclose(np.array(grid.direction)[:, 0], (0, 0, 1))
    assert grid.spacing_mm_zyx[2] == pytest.approx(1e-6 * 3 / 3)


@pytest.mark.parametrize(
    ("words", "code"),
    [
        ((12, "i", (4,)), "VP1301"),
        ((52, "f", (80.0,)), "VP1301"),
        ((64, "3i", (1, 1, 2)), "VP1301"),
        ((88, "i", (401,)), "VP1301"),
        ((8, "i", (2,)), "VP1008"),
        ((92, "i", (80,)), "VP1008"),
    ],
)
def test_what_is_no_plain_map_is_refused(tmp_path: Path, words: tuple, code: str) -> None:
    with pytest.raises(VolprepError, match=code):
        read(write(tmp_path / "a.mrc", noise("int16"), odd=words))


@pytest.mark.parametrize(
    ("limits", "imod", "is_signed"),
    [
        ((0, 250), (IMOD, 0), False),  # IMOD, and a header that agrees
        ((0, 250), (IMOD, 1), False),  # the values of the header decide against the flag
        ((-100, 100), (IMOD, 0), True),
        ((0, 100), (IMOD, 0), False),
        ((0, 100), (IMOD, 1), True),
        ((0, -1), (0, 0), True),  # no statistics
        ((0, 250), (0, 0), False),
    ],
)
def test_the_header_says_whether_bytes_are_signed(tmp_path, limits, imod, is_signed) -> None:
    voxels = np.random.default_rng(3).integers(-128, 128, SHAPE).astype(np.int8)
    words = {"range": (76, "2f", limits), "imod": (152, "2i", imod)}
    found, info = read(write(tmp_path / "a.mrc", voxels, **words))
    np.testing.assert_array_equal(found, voxels if is_signed else voxels.view(np.uint8))
    assert any("unsigned" in remark for remark in info.remarks) == (not is_signed)
