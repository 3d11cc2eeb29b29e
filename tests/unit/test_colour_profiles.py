"""Pictures whose colours are not sRGB: profiles and gammas, against the matrices of their primaries."""

import struct
import zlib
from pathlib import Path

import imagecodecs
import numpy as np
import OpenImageIO
import pytest
from PIL import Image, ImageCms

from volprep_formats.isolation import workers
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.source import ColourChannel, SourceInfo, SourceSpec
from volprep_formats.srgb import srgb_of_linear

WHITE = (0.3127, 0.3290)
SRGB = ((0.64, 0.33), (0.30, 0.60), (0.15, 0.06))
WIDE = ((0.68, 0.32), (0.265, 0.69), (0.15, 0.06))
"""Primaries of Display P3, with the green of DCI."""


@pytest.fixture(scope="module", autouse=True)
def kept_workers():
    """Workers live as long as this module."""
    with workers():
        yield


def profile(primaries: tuple[tuple[float, float], ...], gamma: float) -> bytes:
    three = [number for each in primaries for number in (*each, 1.0)]
    return bytes(imagecodecs.cms_profile("rgb", whitepoint=(*WHITE, 1.0), primaries=three, gamma=gamma))


def xyz_of(primaries: tuple[tuple[float, float], ...]) -> np.ndarray:
    """The matrix from linear light of these primaries to XYZ."""
    corners = np.array([(x / y, 1.0, (1 - x - y) / y) for x, y in primaries]).T
    x, y = WHITE
    return corners * np.linalg.solve(corners, [x / y, 1.0, (1 - x - y) / y])


def light_in_srgb(colours: np.ndarray, primaries: tuple[tuple[float, float], ...], gamma: float) -> np.ndarray:
    """Linear light of sRGB's primaries of encoded colours from 0 to 1."""
    matrix = np.linalg.solve(xyz_of(SRGB), xyz_of(primaries))
    return np.clip(colours**gamma @ matrix.T, 0.0, 1.0)


def codes(dtype: str, channels: int = 3) -> np.ndarray:
    largest = np.iinfo(dtype).max
    return np.random.default_rng(6).integers(largest // 8, largest, (9, 7, channels), dtype)


def tiff(file: Path, pixels: np.ndarray, of: bytes, *, is_premultiplied: bool = False) -> Path:
    spec = OpenImageIO.ImageSpec(*pixels.shape[1::-1], pixels.shape[2], str(pixels.dtype))
    spec.attribute("ICCProfile", OpenImageIO.TypeDesc(f"uint8[{len(of)}]"), np.frombuffer(of, np.uint8))
    spec.attribute("oiio:UnassociatedAlpha", int(not is_premultiplied))
    output = OpenImageIO.ImageOutput.create(str(file))
    assert output.open(str(file), spec), output.geterror()
    assert output.write_image(pixels), output.geterror()
    output.close()
    return file


def png(file: Path, pixels: np.ndarray, gamma: float) -> Path:
    Image.fromarray(pixels).save(file)
    whole = file.read_bytes()
    data = struct.pack(">I", round(100_000 / gamma))
    chunk = struct.pack(">I", 4) + b"gAMA" + data + struct.pack(">I", zlib.crc32(b"gAMA" + data))
    file.write_bytes(whole[:33] + chunk + whole[33:])
    return file


def light(file: Path) -> tuple[np.ndarray, SourceInfo]:
    """Linear light [y, x, 3] of a picture as volprep reads it, times alpha if it has one."""
    found = []
    for part in ("red", "green", "blue"):
        wanted = ColourChannel(part=part, opacity_of="luminance", shares=((0.0, 1.0), (1.0, 1.0)))
        with open_source(SourceSpec(path=str(file), colour=wanted), Path(), Silent()) as source:
            found.append(source.read_slab(0, 1)[0] / 65535)
            info = source.info
    return np.stack(found, axis=-1), info


def is_said(info: SourceInfo) -> bool:
    return any("converted to sRGB" in remark for remark in info.remarks)


def off(found: np.ndarray, expected: np.ndarray) -> float:
    """Largest difference of sRGB numbers."""
    return float(np.abs(srgb_of_linear(found) - srgb_of_linear(expected)).max())


@pytest.mark.parametrize("dtype", ["uint8", "uint16"])
@pytest.mark.parametrize(("primaries", "gamma"), [(WIDE, 1.8), (SRGB, 1.0), (WIDE, 2.4)])
def test_colours_of_a_profile_become_srgb(tmp_path, dtype, primaries, gamma) -> None:
    pixels = codes(dtype)
    found, info = light(tiff(tmp_path / "a.tif", pixels, profile(primaries, gamma)))
    expected = light_in_srgb(pixels / np.iinfo(dtype).max, primaries, gamma)
    assert off(found, expected) < 0.0005
    assert is_said(info)
    unconverted, _ = light(tiff(tmp_path / "b.tif", pixels, profile(SRGB, 2.2)))
    assert off(unconverted, expected) > 0.05


@pytest.mark.parametrize("is_premultiplied", [False, True])
def test_alpha_stays_where_colours_are_converted(tmp_path, is_premultiplied) -> None:
    pixels = codes("uint16", 4)
    share = pixels[..., 3:] / 65535
    stored = pixels.copy()
    if is_premultiplied:
        stored[..., :3] = np.rint(pixels[..., :3] * share)
    found, info = light(tiff(tmp_path / "a.tif", stored, profile(WIDE, 1.8), is_premultiplied=is_premultiplied))
    assert is_said(info)
    assert off(found / share, light_in_srgb(pixels[..., :3] / 65535, WIDE, 1.8)) < 0.0005


def test_the_gamma_of_a_png_is_converted(tmp_path) -> None:
    pixels = codes("uint8")
    for gamma in (1.0, 1.8):
        found, info = light(png(tmp_path / "a.png", pixels, gamma))
        assert off(found, light_in_srgb(pixels / 255, SRGB, gamma)) < 0.0005
        assert is_said(info)


def test_profiles_of_srgb_change_nothing(tmp_path) -> None:
    pixels = codes("uint8")
    Image.fromarray(pixels).save(tmp_path / "plain.png")
    expected, _ = light(tmp_path / "plain.png")
    of_srgb = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    for file in (tiff(tmp_path / "a.tif", pixels, of_srgb), png(tmp_path / "a.png", pixels, 2.2)):
        found, info = light(file)
        assert (np.array_equal(found, expected), is_said(info)) == (True, False)


@pytest.mark.parametrize(
    "damaged", [bytes(200), profile(WIDE, 1.8)[:150], ImageCms.ImageCmsProfile(ImageCms.createProfile("LAB")).tobytes()]
)
def test_a_profile_that_cannot_be_used_is_said_and_not_applied(tmp_path, damaged) -> None:
    pixels = codes("uint8")
    Image.fromarray(pixels).save(tmp_path / "plain.png")
    expected, _ = light(tmp_path / "plain.png")
    found, info = light(tiff(tmp_path / "a.tif", pixels, damaged))
    assert np.array_equal(found, expected)
    assert any("damaged or of other colours" in remark for remark in info.remarks)


def test_grey_values_stay_as_they_are_stored(tmp_path) -> None:
    pixels = codes("uint8")
    file = tiff(tmp_path / "a.tif", pixels, profile(WIDE, 1.8))
    with open_source(SourceSpec(path=str(file), rgb="red"), Path(), Silent()) as source:
        assert np.array_equal(source.read_slab(0, 1)[0], pixels[..., 0])
        assert any("not applied to grey values" in remark for remark in source.info.remarks)
