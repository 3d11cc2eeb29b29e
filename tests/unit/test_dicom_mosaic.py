"""Siemens mosaics: where each tile lies, and which private headers are believed."""

import struct
from pathlib import Path

import numpy as np
import pytest
from dicom_files import image, save

from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.source import SourceInfo, SourceSpec

ROW, COLUMN = np.array([0.6, 0.8, 0.0]), np.array([0.0, 0.0, -1.0])
NORMAL = np.cross(ROW, COLUMN)
SHAPE_YX, SPACING_YX, PITCH = (3, 4), (1.5, 1.25), 3.6
FIRST = np.array([-10.0, 20.0, 30.5])


def csa(entries: dict[str, list[str]], version: int = 2) -> bytes:
    """A CSA header with these entries."""
    header = b"SV10\4\3\2\1" if version == 2 else b""
    header += struct.pack("<II", len(entries), 77)
    first = len(next(iter(entries.values())))
    for name, texts in entries.items():
        header += name.encode().ljust(64, b"\0") + struct.pack("<i4siII", len(texts), b"FD\0\0", 4, len(texts), 77)
        for text in texts:
            length = len(text) + 1
            header += struct.pack("<4i", length + (first if version == 1 else 0), length, 77, length)
            header += text.encode().ljust(-(-length // 4) * 4, b"\0")
    return header


def csa_of(normal: np.ndarray, count: int = 7, version: int = 2) -> bytes:
    entries = {"Comment": ["a", "b"], "NumberOfImagesInMosaic": [str(count)]}
    return csa({**entries, "SliceNormalVector": [f"{n:.8f}" for n in normal]}, version)


def mosaic(header: bytes | None, count: int | None = None, missing: str | None = None):
    """Seven slices in 3×3 tiles; slice k has the values 100·k + 10·y + x."""
    y, x = np.indices(SHAPE_YX)
    slices = [100 * k + 10 * y + x for k in range(7)] + [np.full(SHAPE_YX, 999)] * 2
    rows = [np.hstack(slices[3 * r : 3 * r + 3]) for r in range(3)]
    pixels = np.vstack(rows).astype(np.int16)
    # As the scanner writes it: as if the picture were one large slice around the middle of the first slice.
    beside = np.array([2 * SHAPE_YX[0] * SPACING_YX[0], 2 * SHAPE_YX[1] * SPACING_YX[1]]) / 2
    data = image(
        pixels,
        FIRST - COLUMN * beside[0] - ROW * beside[1],
        orientation=np.concatenate((ROW, COLUMN)),
        spacing_mm_yx=SPACING_YX,
        ImageType=["ORIGINAL", "PRIMARY", "M", "MOSAIC"],
        SliceThickness="3",
        SpacingBetweenSlices=str(PITCH),
    )
    if missing is not None:
        del data[missing]
    if header is not None:
        data.add_new((0x0029, 0x0010), "LO", "SIEMENS CSA HEADER")
        data.add_new((0x0029, 0x1010), "OB", header)
    if count is not None:
        data.add_new((0x0019, 0x0010), "LO", "SIEMENS MR HEADER")
        data.add_new((0x0019, 0x100A), "US", count)
    return data


def read(path: Path) -> tuple[np.ndarray, SourceInfo]:
    with open_source(SourceSpec(path=str(path)), Path(), Silent()) as source:
        return source.read_slab(0, source.info.grid.shape_zyx[0]), source.info


@pytest.mark.parametrize("version", [1, 2])
@pytest.mark.parametrize("sign", [1, -1])
def test_every_voxel_of_a_mosaic_lies_where_its_slice_was_taken(tmp_path, sign, version) -> None:
    voxels, info = read(save(mosaic(csa_of(sign * NORMAL, version=version)), tmp_path / "m"))
    assert voxels.shape == info.grid.shape_zyx == (7, *SHAPE_YX)
    assert info.grid.spacing_mm_zyx == pytest.approx((PITCH, *SPACING_YX))
    assert np.linalg.det(info.grid.direction) == pytest.approx(1.0)
    for z, y, x in np.ndindex(voxels.shape):
        k, row, column = voxels[z, y, x] // 100, voxels[z, y, x] // 10 % 10, voxels[z, y, x] % 10
        there = FIRST + ROW * SPACING_YX[1] * column + COLUMN * SPACING_YX[0] * row + sign * NORMAL * PITCH * k
        np.testing.assert_allclose((info.grid.world_from_index @ [x, y, z, 1])[:3], there, atol=1e-9)


def test_a_slab_is_cut_out_of_the_mosaic(tmp_path) -> None:
    save(mosaic(csa_of(NORMAL)), tmp_path / "m")
    with open_source(SourceSpec(path="."), tmp_path, Silent()) as source:
        assert (source.read_slab(2, 5)[:, 1, 2] // 100).tolist() == [2, 3, 4]


def test_the_count_may_stand_outside_the_csa_header_too(tmp_path) -> None:
    voxels, _ = read(save(mosaic(csa_of(NORMAL, count=7), count=7), tmp_path / "m"))
    assert len(voxels) == 7


@pytest.mark.parametrize(
    ("data", "code", "said"),
    [
        (mosaic(None), "VP1042", "how many slices"),
        (mosaic(None, count=7), "VP1042", "which way its slices follow"),
        (mosaic(csa_of(NORMAL, count=0)), "VP1042", "how many slices"),
        (mosaic(csa_of(NORMAL, count=26)), "VP1042", "26 slices do not fit into 12×9 pixels"),
        (mosaic(csa_of(ROW)), "VP1042", "normal"),
        (mosaic(csa_of(NORMAL, count=9), count=7), "VP1042", "says that it holds 7 and 9 slices"),
        (mosaic(csa_of(np.array([np.nan, 0, 1]))), "VP1042", "which way"),
        (mosaic(csa_of(NORMAL), missing="SpacingBetweenSlices"), "VP1036", "SpacingBetweenSlices"),
        (mosaic(csa_of(NORMAL), missing="PixelSpacing"), "VP1036", "PixelSpacing"),
    ],
)
def test_a_mosaic_whose_slices_have_no_certain_place_is_refused(tmp_path, data, code, said) -> None:
    with pytest.raises(VolprepError) as error:
        read(save(data, tmp_path / "m"))
    assert error.value.code == code
    assert said in str(error.value)


def test_every_prefix_and_many_mutations_of_a_csa_header_end_in_an_error_or_the_volume(tmp_path) -> None:
    whole = csa_of(NORMAL)
    good, _ = read(save(mosaic(whole), tmp_path / "m"))
    chance = np.random.default_rng(4)
    headers = [whole[:size] for size in range(0, len(whole), 16)]
    for _ in range(60):
        mutated = np.frombuffer(whole, np.uint8).copy()
        mutated[chance.integers(0, len(whole), 4)] = chance.integers(0, 256, 4)
        headers.append(mutated.tobytes())
    codes = []
    for header in headers:
        try:
            voxels, _ = read(save(mosaic(header, count=7), tmp_path / "m"))
        except VolprepError as error:
            codes.append(error.code)
        else:
            assert np.array_equal(voxels, good)
    assert set(codes) == {"VP1042"}
    assert len(codes) > 40
