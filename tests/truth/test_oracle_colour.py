"""The oracle of a volume in colour, against a slow twin and laws."""

import numpy as np
import pytest
from scene_builds import view_of
from scipy.ndimage import map_coordinates

from volprep.compositing import COMPOSITINGS
from volprep.scene.colour import PARTS, transfer_of
from volprep.scene.transfer import SceneTransfer
from volprep.truth.colour import media_of_colour
from volprep.truth.volume import Medium, Volume
from volprep_formats.grid import Grid

GRID = Grid.of((5, 6, 7), (1.5, 1.0, 0.8))
LARGEST_PER_MM = 0.7
PIXELS = 5
SAMPLES = 20_000


def camera(view: str = "anterior-left") -> np.ndarray:
    return view_of(GRID, view)


def volumes(seed: int = 4) -> np.ndarray:
    """Premultiplied light and extinction [part, z, y, x], as stored values of 16 bits."""
    rng = np.random.default_rng(seed)
    share = rng.uniform(0.0, 1.0, GRID.shape_zyx) ** 2
    light = rng.uniform(0.0, 1.0, (3, *GRID.shape_zyx)) * share
    return np.rint(np.concatenate([light, share[None]]) * 65535).astype(np.uint16)


def field(stored: np.ndarray) -> Volume:
    return Volume(stored, GRID, 1 / 65535)


def channels(stored: np.ndarray, largest_per_mm: float = LARGEST_PER_MM) -> list[Medium]:
    return [
        Medium(field(volume), SceneTransfer.model_validate(transfer_of(part, largest_per_mm)).resolved())
        for part, volume in zip(PARTS, stored, strict=True)
    ]


def drawn(media: list[Medium], view: str = "anterior-left") -> np.ndarray:
    oracle = COMPOSITINGS["emission-absorption"].oracle
    return oracle(media, camera(view), (PIXELS, PIXELS)).rgba


def twin(stored: np.ndarray, row: int, column: int) -> np.ndarray:
    """The integral along the ray of a pixel, by many samples of the trilinear fields of light and extinction."""
    x, y = (2 * column + 1) / PIXELS - 1, 1 - (2 * row + 1) / PIXELS
    near, far = (camera() @ [x, y, z, 1.0] for z in (-1.0, 1.0))
    near, far = near[:3] / near[3], far[:3] / far[3]
    ends = np.stack([-near, np.array(GRID.extent_mm_zyx[::-1]) - near]) / (far - near)
    enter, leave = ends.min(axis=0).max(), ends.max(axis=0).min()
    at = enter + (np.arange(SAMPLES) + 0.5) / SAMPLES * (leave - enter)
    places = near + at[:, None] * (far - near)
    indices = (places / np.array(GRID.spacing_mm_zyx[::-1]) - 0.5).T[::-1]
    fields = np.stack([map_coordinates(each / 65535, indices, order=1, mode="nearest") for each in stored])
    step = LARGEST_PER_MM * np.linalg.norm(far - near) * (leave - enter) / SAMPLES
    depth = np.cumsum(fields[3]) * step
    through = np.exp(-(depth - fields[3] * step / 2))
    return np.array([*(fields[:3] * through).sum(axis=1) * step, 1.0 - np.exp(-depth[-1])])


@pytest.mark.parametrize("pixel", [(2, 2), (1, 3), (3, 1)])
def test_the_oracle_is_the_integral_of_premultiplied_light(pixel: tuple[int, int]) -> None:
    stored = volumes()
    expected = twin(stored, *pixel)
    assert expected[3] > 0.2
    assert np.abs(drawn(media_of_colour(channels(stored)))[pixel] - expected).max() < 2e-6


def test_equal_light_of_all_colours_is_a_grey_medium() -> None:
    share = volumes()[3]
    grey = SceneTransfer.model_validate(
        {
            "name": "white",
            "points": [
                {"value": 0.0, "colour": "#ffffff", "extinction_per_mm": 0.0},
                {"value": 1.0, "colour": "#ffffff", "extinction_per_mm": LARGEST_PER_MM},
            ],
        }
    ).resolved()
    found = drawn(media_of_colour(channels(np.stack([share] * 4))))
    assert np.abs(found - drawn([Medium(field(share), grey)])).max() < 5e-6


def test_colours_that_change_places_change_nothing_else() -> None:
    stored = volumes()
    swapped = drawn(media_of_colour(channels(stored[[2, 1, 0, 3]])))
    assert np.abs(swapped[..., [2, 1, 0, 3]] - drawn(media_of_colour(channels(stored)))).max() < 5e-6


def test_dark_voxels_absorb_as_bright_ones_do() -> None:
    stored = volumes()
    dark = stored.copy()
    dark[:3] = 0
    bright, black = (drawn(media_of_colour(channels(each))) for each in (stored, dark))
    assert np.abs(black[..., :3]).max() < 5e-6
    assert np.abs(black[..., 3] - bright[..., 3]).max() < 5e-6
