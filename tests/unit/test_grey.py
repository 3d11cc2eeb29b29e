"""Colours become luminance, or one of them is taken, where the scene asks for it, and only there."""

import numpy as np
import OpenImageIO
import pytest
from command_line import volprep
from dicom_files import image, save, save_all
from pydicom.uid import ExplicitVRBigEndian, ImplicitVRLittleEndian

from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.readers.grey import grey_of
from volprep_formats.source import SourceSpec, StackLayout, TileLayout

pytestmark = pytest.mark.usefixtures("kept_workers")

WEIGHTS = np.array([0.299, 0.587, 0.114])
COLOURS = np.random.default_rng(2).integers(0, 256, (4, 5, 6, 3)).astype(np.uint8)


def rounded(colours):
    return np.floor(colours.astype(float) @ WEIGHTS + 0.5 + 1e-9)


def read(path, **told):
    with open_source(SourceSpec(path=str(path), **told), path, Silent()) as source:
        return source.read_slab(0, source.info.grid.shape_zyx[0]), source.info


def dicom(slices, *, planes=False, **attributes):
    """Slices [z, y, x, 3] as a series."""
    images = []
    for z, colours in enumerate(slices):
        pixels = np.moveaxis(colours, -1, 0) if planes else colours
        data = image(
            pixels.reshape(colours.shape[0], -1),
            (0, 0, 2.0 * z),
            Columns=colours.shape[1],
            SamplesPerPixel=3,
            PlanarConfiguration=int(planes),
            PhotometricInterpretation="RGB",
            **attributes,
        )
        images.append(data)
    return images


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_grey_stays_what_it_is_and_colours_have_their_weights(dtype) -> None:
    ramp = np.linspace(0, 255 if dtype == np.uint8 else 65535, 256).astype(dtype)
    grey = grey_of(np.stack([ramp] * 3, axis=-1), "luminance")
    assert grey.dtype == dtype
    np.testing.assert_array_equal(grey, ramp)
    primaries = grey_of(np.eye(3, dtype=dtype) * dtype(200), "luminance")
    np.testing.assert_allclose(primaries, [59.8, 117.4, 22.8] if dtype == np.float32 else [60, 117, 23], rtol=1e-6)


@pytest.mark.parametrize("planes", [False, True])
@pytest.mark.parametrize("factor", [1, 257])
def test_a_dicom_series_in_colour_becomes_grey_on_request(tmp_path, planes, factor) -> None:
    colours = COLOURS.astype(np.uint16) * factor if factor > 1 else COLOURS
    save_all(dicom(colours, planes=planes), tmp_path, ImplicitVRLittleEndian)
    with pytest.raises(VolprepError, match=r"VP1035.*\(RGB\).*rgb = \"luminance\""):
        read(tmp_path)
    voxels, info = read(tmp_path, rgb="luminance")
    np.testing.assert_array_equal(voxels, rounded(colours))
    assert voxels.dtype == colours.dtype
    assert any("luminance" in remark for remark in info.remarks)
    assert not any("left out" in remark for remark in info.remarks)


@pytest.mark.parametrize(("colour", "index"), [("red", 0), ("green", 1), ("blue", 2)])
def test_one_colour_is_taken_from_dicom_pictures_and_mosaics(tmp_path, colour, index) -> None:
    save_all(dicom(COLOURS, planes=True), tmp_path / "series", ImplicitVRLittleEndian)
    (tmp_path / "stack").mkdir()
    for z, colours in enumerate(COLOURS):
        write_png(tmp_path / "stack" / f"{z}.png", colours)
    for place, told in (("series", {}), ("stack", {"stack": StackLayout()})):
        voxels, info = read(tmp_path / place, rgb=colour, **told)
        np.testing.assert_array_equal(voxels, COLOURS[..., index])
        assert any(f"{colour} is taken" in remark for remark in info.remarks)


def test_the_command_makes_colours_grey_on_request(tmp_path) -> None:
    save_all(dicom(COLOURS), tmp_path / "series", ImplicitVRLittleEndian)
    kept = volprep("import", tmp_path / "series", "-o", tmp_path / "kept.volpkg")
    assert (kept.returncode, (tmp_path / "kept.volpkg/work/level0-red.raw").exists()) == (0, True)
    done = volprep("import", tmp_path / "series", "-o", tmp_path / "a.volpkg", "--rgb", "luminance")
    assert done.returncode == 0, done.stderr
    np.testing.assert_array_equal(
        np.fromfile(tmp_path / "a.volpkg/work/level0-scan.raw", np.uint8), rounded(COLOURS).ravel()
    )


OTHER_COLOURS = {
    "signed": {"PixelRepresentation": 1},
    "not RGB": {"PhotometricInterpretation": "YBR_PARTIAL_420"},
    "seven bits": {"BitsStored": 7},
    "an unsound order": {"PlanarConfiguration": 2},
    "a mosaic": {"ImageType": ["ORIGINAL", "PRIMARY", "M", "MOSAIC"]},
}


@pytest.mark.parametrize("attributes", OTHER_COLOURS.values(), ids=OTHER_COLOURS)
def test_colours_of_other_kinds_are_refused_all_the_same(tmp_path, attributes) -> None:
    images = dicom(COLOURS)
    for data in images:
        for keyword, value in attributes.items():
            setattr(data, keyword, value)
    save_all(images, tmp_path)
    with pytest.raises(VolprepError, match="VP1035"):
        read(tmp_path, rgb="luminance")


def test_big_endian_colours_are_refused_all_the_same(tmp_path) -> None:
    save_all(dicom(COLOURS), tmp_path, ExplicitVRBigEndian)
    with pytest.raises(VolprepError, match="VP1035"):
        read(tmp_path, rgb="luminance")


def test_what_else_is_wrong_with_an_image_in_colour_is_not_forgiven(tmp_path) -> None:
    save_all(dicom(COLOURS, RescaleSlope="0", RescaleIntercept="1"), tmp_path)
    with pytest.raises(VolprepError, match=r"VP1037.*RescaleSlope"):
        read(tmp_path, rgb="luminance")


def test_a_picture_in_colour_that_is_too_short_is_refused(tmp_path) -> None:
    images = dicom(COLOURS)
    images[2].PixelData = images[2].PixelData[:60]
    for k, data in enumerate(images):
        save(data, tmp_path / str(k))
    with pytest.raises(VolprepError, match="VP1040"):
        read(tmp_path, rgb="luminance")


def write_png(path, values):
    output = OpenImageIO.ImageOutput.create(str(path))
    assert output.open(str(path), OpenImageIO.ImageSpec(values.shape[1], values.shape[0], values.shape[2], "uint8"))
    assert output.write_image(np.ascontiguousarray(values))
    output.close()


def test_pictures_in_colour_become_grey_on_request(tmp_path) -> None:
    for z, colours in enumerate(COLOURS):
        write_png(tmp_path / f"{z}.png", colours)
    with pytest.raises(VolprepError, match="VP1164"):
        read(tmp_path, stack=StackLayout())
    voxels, info = read(tmp_path, stack=StackLayout(), rgb="luminance")
    np.testing.assert_array_equal(voxels, rounded(COLOURS))
    assert any("luminance" in remark for remark in info.remarks)


def test_a_mosaic_in_colour_becomes_grey_on_request(tmp_path) -> None:
    tiles = COLOURS.reshape(2, 2, 5, 6, 3).swapaxes(1, 2).reshape(10, 12, 3)
    write_png(tmp_path / "m.png", tiles)
    layout = TileLayout(tiles_x=2, tiles_y=2, slices=4)
    with pytest.raises(VolprepError, match="VP1164"):
        read(tmp_path / "m.png", mosaic=layout)
    voxels, _ = read(tmp_path / "m.png", mosaic=layout, rgb="luminance")
    np.testing.assert_array_equal(voxels, rounded(COLOURS))


def test_transparent_pixels_are_refused_all_the_same(tmp_path) -> None:
    for z in range(2):
        write_png(tmp_path / f"{z}.png", np.concatenate((COLOURS[z], np.full((5, 6, 1), 100, np.uint8)), axis=-1))
    with pytest.raises(VolprepError, match=r"VP1164.*transparent"):
        read(tmp_path, stack=StackLayout(), rgb="luminance")


def test_the_setting_belongs_to_pictures(tmp_path) -> None:
    (tmp_path / "a.nrrd").write_bytes(b"NRRD0004\n")
    with pytest.raises(VolprepError, match=r"VP1004.*rgb"):
        read(tmp_path / "a.nrrd", rgb="luminance")
