"""Pictures for people: encoding, preview, and the half floats of 16-bit codes."""

import numpy as np
import OpenImageIO
import pytest
from small_previews import FULL, small_previews
from tiny_packages import ES2, ES3, function, tiny_package

from volprep.parts.texels import texels_of
from volprep.pipeline.preview import preview_png
from volprep.truth.picture import encoded

# Half-transparent orange, premultiplied linear: 0.5 · (1, 0.214, 0), whose sRGB is (255, 127, 0).
ORANGE = np.array([[[0.5, 0.107, 0.0, 0.5], [0.0, 0.0, 0.0, 0.0]]], dtype=np.float32)


def test_over_black_and_white_light_is_added_before_it_is_encoded():
    # 0.5 is 188 in sRGB, 0.607 is 204.
    assert encoded(ORANGE, "black").tolist() == [[[188, 92, 0], [0, 0, 0]]]
    assert encoded(ORANGE, "white").tolist() == [[[255, 204, 188], [255, 255, 255]]]


def test_a_transparent_picture_has_colours_not_multiplied_by_alpha():
    assert encoded(ORANGE, "transparent").tolist() == [[[255, 127, 0, 128], [0, 0, 0, 0]]]


def test_what_float32_puts_above_1_is_clipped():
    assert encoded(np.full((1, 1, 4), 1.00001, np.float32), "transparent").tolist() == [[[255, 255, 255, 255]]]


@pytest.mark.parametrize("profile", [ES2, ES3], ids=["es2", "es3"])
def test_the_preview_is_a_picture_of_the_package_and_always_the_same_bytes(tmp_path, profile):
    codes = np.full((9, 9, 9), 255, np.uint8)
    package = tiny_package(tmp_path / "p", codes, function((0.0, (1.0, 0.0, 0.0), 5.0)), profile)
    with small_previews(FULL):
        one, other = preview_png(package), preview_png(package)
    assert one == other
    (tmp_path / "preview.png").write_bytes(one)
    picture = OpenImageIO.ImageBuf(str(tmp_path / "preview.png")).get_pixels(OpenImageIO.UINT8)
    assert picture.shape == (256, 256, 3)
    assert picture[128, 128].tolist() == [255, 0, 0]
    assert picture[0, 0].tolist() == [0, 0, 0]


def test_codes_are_texels_but_where_16_bits_become_half_floats_of_0_to_1():
    narrow = np.array([[[0, 1, 255]]], np.uint8)
    assert texels_of(narrow, "r8unorm") is narrow
    every = np.arange(65536, dtype=np.uint16).reshape(16, 64, 64)
    assert texels_of(every, "r16unorm") is every
    texels = texels_of(every, "r16float")
    assert texels.dtype == np.float16
    assert (texels[0, 0, 0], texels[-1, -1, -1]) == (0.0, 1.0)
    assert np.abs(texels.astype(np.float64) - every / 65535).max() <= 2.0**-12
    assert (np.diff(texels.reshape(-1).astype(np.float64)) >= 0).all()
