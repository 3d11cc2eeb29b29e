import numpy as np
import pytest

from volprep.truth.metrics import over, picture_error


def disc(colour=(0.5, 0.25, 0.1), alpha=0.8, size=48, radius=12.0):
    """A soft disc on nothing, premultiplied."""
    rows, columns = np.indices((size, size)) - (size - 1) / 2
    opacity = alpha * np.clip(radius - np.hypot(rows, columns), 0, 1)
    return opacity[..., None] * np.array([*colour, 1.0])


def test_equal_pictures_have_no_error():
    error = picture_error(disc(), disc().astype(np.float64))
    assert (error.rmse, error.maximum) == (0.0, 0.0)
    assert (error.psnr_black_db, error.psnr_white_db) == (None, None)
    assert error.ssim_black == pytest.approx(1.0, abs=1e-12)
    assert error.ssim_white == pytest.approx(1.0, abs=1e-12)


def test_empty_pictures_have_no_error():
    error = picture_error(np.zeros((11, 12, 4)), np.zeros((11, 12, 4)))
    assert (error.rmse, error.psnr_white_db, error.ssim_black, error.ssim_white) == (0.0, None, 1.0, 1.0)


def test_rmse_and_maximum_count_all_pixels_and_four_premultiplied_channels():
    truth = np.zeros((20, 30, 4))
    picture = truth.copy()
    picture[3, 4] = (0.1, 0.0, 0.0, 0.3)
    picture[5, 6] = (0.0, 0.0, -0.4, 0.0)
    error = picture_error(picture, truth)
    assert error.maximum == pytest.approx(0.4)
    assert error.rmse == pytest.approx(np.sqrt((0.01 + 0.09 + 0.16) / (20 * 30 * 4)))


def test_psnr_counts_the_foreground_of_either_picture_in_srgb():
    truth = np.zeros((20, 30, 4))
    truth[2, 2:5] = (0.5, 0.5, 0.5, 1.0)
    picture = truth.copy()
    picture[2, 2] = (0.0031308, 0.5, 0.5, 1.0)  # in sRGB 0.04045
    picture[9, 9] = (0.0, 0.0, 0.0, 0.5)  # alone in one picture: nothing over black, half over white
    error = picture_error(picture, truth)
    half = 1.055 * 0.5 ** (1 / 2.4) - 0.055
    over_black = (half - 0.04045) ** 2 / (4 * 3)
    over_white = ((half - 0.04045) ** 2 + 3 * (1 - half) ** 2) / (4 * 3)
    assert error.psnr_black_db == pytest.approx(-10 * np.log10(over_black), abs=1e-4)
    assert error.psnr_white_db == pytest.approx(-10 * np.log10(over_white), abs=1e-4)


def test_a_wrong_alpha_shows_over_one_background_only():
    truth, wrong = disc(), disc()
    wrong[..., 3] *= 0.5
    error = picture_error(wrong, truth)
    assert error.psnr_black_db is None
    assert error.psnr_white_db < 20
    assert error.ssim_black == pytest.approx(1.0)
    assert error.ssim_white < 0.9


def test_empty_surroundings_do_not_make_a_picture_better():
    def bordered(picture, width):
        return np.pad(picture, ((width, width), (width, width), (0, 0)))

    wrong = disc(colour=(0.4, 0.3, 0.1))
    narrow, wide = (picture_error(bordered(wrong, w), bordered(disc(), w)) for w in (0, 40))
    assert wide.psnr_black_db == pytest.approx(narrow.psnr_black_db)
    assert wide.ssim_black == pytest.approx(narrow.ssim_black)
    assert wide.rmse < narrow.rmse


def test_ssim_is_that_of_its_definition():
    rng = np.random.default_rng(0)
    truth, picture = disc(), disc()
    picture[..., :3] += rng.normal(0, 0.02, picture[..., :3].shape) * (picture[..., 3:] > 0)
    window = np.exp(-(np.arange(-5, 6) ** 2) / (2 * 1.5**2))
    window = np.outer(window, window) / window.sum() ** 2
    one, other = over(picture, "white"), over(truth, "white")
    similar = []
    for row, column in np.argwhere((picture[..., 3] > 0) | (truth[..., 3] > 0)):
        x, y = (image[row - 5 : row + 6, column - 5 : column + 6].reshape(121, 3) for image in (one, other))
        w = window.ravel()
        mx, my = w @ x, w @ y
        vx, vy, cxy = w @ x**2 - mx**2, w @ y**2 - my**2, w @ (x * y) - mx * my
        similar.append((2 * mx * my + 1e-4) * (2 * cxy + 9e-4) / ((mx**2 + my**2 + 1e-4) * (vx + vy + 9e-4)))
    assert picture_error(picture, truth).ssim_white == pytest.approx(np.mean(similar), abs=1e-12)


def test_over_composites_in_linear_light_and_clips():
    picture = np.array([[[0.25, 0.0, 2.0, 0.5]]])
    srgb = lambda v: 1.055 * v ** (1 / 2.4) - 0.055  # noqa: E731 - the curve, once
    np.testing.assert_allclose(over(picture, "black")[0, 0], [srgb(0.25), 0.0, 1.0])
    np.testing.assert_allclose(over(picture, "white")[0, 0], [srgb(0.75), srgb(0.5), 1.0])


def test_pictures_of_other_shapes_are_refused():
    with pytest.raises(ValueError, match="cannot be compared"):
        picture_error(np.zeros((12, 12, 4)), np.zeros((12, 13, 4)))
