"""Times of pictures, on clocks that a test moves."""

import pytest

from tests.benchmarks.drawing_time import best_ms, honest_ms
from tests.benchmarks.waking import is_software

LLVMPIPE, GPU = "llvmpipe (LLVM 15.0.6, 256 bits)", "NVIDIA H100 80GB HBM3/PCIe/SSE2"


def timed(ms_of_picture, rounds):
    """What `best_ms` makes of pictures that take so long, and how many it drew at a time."""
    drawn = []

    def ms_of(pictures):
        drawn.append(pictures)
        return ms_of_picture

    return best_ms(LLVMPIPE, ms_of, rounds=rounds), drawn


@pytest.mark.parametrize(
    ("ms", "drawn"),
    [
        (0.0, [1, 64, 64, 64]),
        (0.1, [1, 64, 64, 64]),
        (10.0, [1, 3, 3, 3]),
        (100.0, [1, 1, 1, 1]),
        (300.0, [1, 1, 1]),
        (1000.0, [1, 1]),
    ],
)
def test_quick_pictures_are_drawn_often_and_slow_ones_once(ms, drawn):
    best, found = timed(ms, rounds=3)
    assert found == drawn
    assert best == pytest.approx(ms, abs=1e-3)


def test_what_a_clock_does_not_see_takes_some_time_all_the_same():
    best, _ = timed(0.0, rounds=2)
    assert best > 0.0


def test_on_a_gpu_the_clock_on_the_wall_counts_and_on_a_software_driver_the_processor():
    assert is_software(LLVMPIPE)
    assert not is_software(GPU)
    assert honest_ms(GPU, 7.0, 1000.0) == 7.0
    assert honest_ms(LLVMPIPE, 7000.0, 1.0) <= 1.0
