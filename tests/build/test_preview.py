"""The preview shows what is seen, as large as it fits."""

import numpy as np
import pytest

from volprep.pipeline.preview import window_of_seen


def seen(rows: slice, columns: slice, shape_hw=(64, 64)) -> np.ndarray:
    opacity = np.full(shape_hw, 0.01, np.float32)
    opacity[rows, columns] = 0.5
    return opacity


@pytest.mark.parametrize(
    ("rows", "columns", "centre"),
    [
        (slice(24, 40), slice(24, 40), (0.0, 0.0)),
        (slice(0, 16), slice(0, 16), (-0.735, 0.735)),
        (slice(40, 48), slice(8, 24), (-0.5, -0.375)),
    ],
)
def test_a_window_holds_all_that_is_seen_with_little_around_it(rows, columns, centre) -> None:
    window = window_of_seen(seen(rows, columns))
    assert window[:2, 3] == pytest.approx(centre, abs=1e-9)
    # A corner of what is seen, in the clip coordinates of the whole, lies within those of the window, near their edge.
    for row, column in ((rows.start, columns.start), (rows.stop, columns.stop)):
        whole = np.array([column / 32 - 1, 1 - row / 32, 0, 1])
        assert np.all(np.abs(np.linalg.solve(window, whole)[:2]) <= 1 + 1e-9)
    assert window[0, 0] == window[1, 1] == pytest.approx(max(rows.stop - rows.start, 16) / 64 * 1.06)


def test_nothing_seen_and_all_seen_are_the_whole() -> None:
    assert np.array_equal(window_of_seen(np.zeros((8, 8), np.float32)), np.eye(4))
    assert np.array_equal(window_of_seen(np.ones((8, 8), np.float32)), np.eye(4))
