"""Pictures averaged over larger pixels, against sums over the parts of pixels that each of them covers."""

import numpy as np
import pytest

from volprep.truth.averaged import averaged


def by_overlaps(picture: np.ndarray, pixels: int) -> np.ndarray:
    size = len(picture)
    edges = np.linspace(0.0, size, pixels + 1)
    own = np.arange(size)
    overlap = np.minimum(edges[1:, None], own + 1) - np.maximum(edges[:-1, None], own)
    weights = np.clip(overlap, 0.0, None) * (pixels / size)
    return np.einsum("ih,hwc,jw->ijc", weights, picture, weights)


@pytest.mark.parametrize("pixels", [1, 2, 7, 8, 15, 16])
@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_a_larger_pixel_is_the_mean_of_what_it_covers(pixels: int, kind: type) -> None:
    picture = np.random.default_rng(4).random((16, 16, 4)).astype(kind)
    found = averaged(picture, pixels)
    assert found.dtype == np.float32
    np.testing.assert_allclose(found, by_overlaps(picture, pixels), atol=1e-7)
