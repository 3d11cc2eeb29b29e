import numpy as np
import pytest

from volprep.truth.metrics import flip_error, over, picture_error


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


def test_flip_is_nothing_for_equal_and_empty_pictures():
    empty = np.zeros((12, 14, 4))
    for picture in (disc(), empty):
        error = flip_error(picture, picture)
        assert (error.black, error.white) == (0.0, 0.0)


def test_flip_is_one_between_what_a_person_sees_as_opposites():
    """Black on white, far larger than the filters of FLIP, is the largest difference that its colours have."""
    black, white = np.zeros((64, 64, 4)), np.ones((64, 64, 4))
    black[..., 3] = 1.0
    error = flip_error(white, black)
    assert error.black == error.white == pytest.approx(0.97, abs=0.03)


def test_flip_counts_the_foreground_alone():
    faint = disc(alpha=0.7)
    framed = [np.pad(each, ((60, 60), (60, 60), (0, 0))) for each in (disc(), faint)]
    near, far = flip_error(faint, disc()), flip_error(framed[1], framed[0])
    assert near.black > 0.01
    assert far.black == pytest.approx(near.black, rel=0.05)
    assert far.white == pytest.approx(near.white, rel=0.05)


def test_flip_over_one_background_does_not_hide_an_error_of_alpha():
    black = disc(colour=(0.0, 0.0, 0.0))
    error = flip_error(disc(colour=(0.0, 0.0, 0.0), alpha=0.6), black)
    assert error.black == 0.0
    assert error.white > 0.1


def test_flip_seems_less_where_pixels_are_smaller():
    """Detail of one pixel: the finer the pixels, the less is seen of it."""
    truth = disc(radius=20.0)
    noise = np.random.default_rng(3).normal(0.0, 0.1, truth.shape[:2])
    picture = np.clip(truth + noise[..., None] * (truth[..., 3:] > 0), 0.0, 1.0)
    assert flip_error(picture, truth, 134.0).black < 0.8 * flip_error(picture, truth, 67.0).black


@pytest.mark.parametrize("place", [(0, 0), (30, 50), (12, 3)])
def test_what_lies_far_from_the_foreground_does_not_change_ssim(place) -> None:
    """The window is 11 pixels across; the whole map would be the slow way."""
    from skimage.metrics import structural_similarity

    chance = np.random.default_rng(8)
    one, other = np.zeros((48, 64, 4)), np.zeros((48, 64, 4))
    y, x = place
    one[y : y + 9, x : x + 7] = chance.uniform(size=(*one[y : y + 9, x : x + 7].shape[:2], 4))
    other[y : y + 9, x : x + 7] = chance.uniform(size=(*one[y : y + 9, x : x + 7].shape[:2], 4))
    _, whole = structural_similarity(
        over(one, "white"),
        over(other, "white"),
        channel_axis=2,
        data_range=1.0,
        gaussian_weights=True,
        sigma=1.5,
        use_sample_covariance=False,
        full=True,
    )
    seen = (one[..., 3] > 0) | (other[..., 3] > 0)
    assert picture_error(one, other).ssim_white == pytest.approx(float(whole[seen].mean()), abs=1e-12)
