"""Mosaics: one picture whose tiles are the slices."""

from pathlib import Path

import numpy as np
import OpenImageIO
import pytest

from volprep_formats.diagnostics import VolprepError
from volprep_formats.isolation import workers
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.readers.mosaic import tile_start
from volprep_formats.source import SourceSpec, TileLayout, VolumeSource

SHAPE_ZYX = (7, 4, 5)


@pytest.fixture(scope="module", autouse=True)
def kept_workers():
    """Workers live as long as this module, not as long as one file is open."""
    with workers():
        yield


def write(file: Path, picture: np.ndarray) -> Path:
    channels = 1 if picture.ndim == 2 else picture.shape[2]
    output = OpenImageIO.ImageOutput.create(str(file))
    assert output.open(str(file), OpenImageIO.ImageSpec(picture.shape[1], picture.shape[0], channels, "uint8"))
    assert output.write_image(picture.reshape(*picture.shape[:2], channels))
    output.close()
    return file


def open_mosaic(file: Path, **layout) -> VolumeSource:
    told = TileLayout(**{"tiles_x": 3, "tiles_y": 3, "slices": 7, **layout})
    return open_source(SourceSpec(path=str(file), mosaic=told), Path(), Silent())


def voxels() -> np.ndarray:
    return np.random.default_rng(6).integers(0, 255, SHAPE_ZYX).astype(np.uint8)


def mosaic(columns: int, rows: int) -> np.ndarray:
    """Three tiles by three of rubbish, with the voxels in the first seven, each from the middle of its beginning."""
    picture = np.full((rows, columns), 255, np.uint8)
    for z, page in enumerate(voxels()):
        top, left = (int(np.floor(k * side / 3 + 0.5)) for k, side in zip(divmod(z, 3), (rows, columns), strict=True))
        picture[top : top + 4, left : left + 5] = page
    return picture


@pytest.mark.parametrize("size", [(15, 12), (16, 12), (17, 14)])
@pytest.mark.parametrize("suffix", [".png", ".tif", ".bmp"])
def test_tiles_are_slices_also_those_of_fractional_size(tmp_path, size, suffix) -> None:
    picture = mosaic(*size)
    picture = np.repeat(picture[..., np.newaxis], 3, axis=-1) if suffix == ".bmp" else picture
    with open_mosaic(write(tmp_path / f"m{suffix}", picture), spacing_mm_zyx=(3, 2, 0.5)) as source:
        assert source.info.grid.shape_zyx == SHAPE_ZYX
        assert source.info.grid.spacing_mm_zyx == (3, 2, 0.5)
        assert any("pixels are cut to 5×4" in remark for remark in source.info.remarks) == (size != (15, 12))
        for z0, z1 in [(0, 7), (2, 4), (6, 7), (0, 3), (3, 3)]:
            assert np.array_equal(source.read_slab(z0, z1), voxels()[z0:z1])


def test_spare_tiles_may_be_in_colour_but_slices_may_not(tmp_path) -> None:
    picture = np.repeat(mosaic(15, 12)[..., np.newaxis], 3, axis=-1)
    picture[8:, 5:, 1] = 7
    with open_mosaic(write(tmp_path / "m.png", picture)) as source:
        assert np.array_equal(source.read_slab(0, 7), voxels())
    picture[8, 0, 1] ^= 1
    with open_mosaic(write(tmp_path / "m.png", picture)) as source, pytest.raises(VolprepError) as error:
        source.read_slab(0, 7)
    assert error.value.code == "VP1164"


@pytest.mark.parametrize("layout", [{"slices": 10}, {"tiles_x": 16}, {"tiles_y": 2**31 - 1}])
def test_tiles_that_do_not_fit_are_refused(tmp_path, layout) -> None:
    with pytest.raises(VolprepError, match="VP1181"):
        open_mosaic(write(tmp_path / "m.png", mosaic(15, 12)), **layout)


def test_a_mosaic_without_tile_counts_is_refused(tmp_path) -> None:
    file = write(tmp_path / "m.png", mosaic(15, 12))
    with pytest.raises(VolprepError, match="VP1180"):
        open_source(SourceSpec(path=str(file), format="mosaic"), Path(), Silent())


def test_tiles_never_overlap_and_never_leave_the_picture() -> None:
    for length in range(1, 60):
        for tiles in range(1, length + 1):
            starts = [tile_start(k, tiles, length) for k in range(tiles)]
            ends = [start + length // tiles for start in starts]
            assert starts[0] == 0
            assert all(end <= start for end, start in zip(ends, [*starts[1:], length], strict=True))
