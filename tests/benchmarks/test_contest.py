"""The arithmetic of the benchmarks, on work whose time is known."""

import time

import numpy as np
import pytest

from .contest import Contest, hold


@pytest.fixture
def slow_work():
    def sleeping(seconds):
        return lambda: time.sleep(seconds)

    return Contest(
        work="nothing",
        source=np.zeros((2, 64, 64), np.uint16),
        bytes_written=8192,
        ours=sleeping(0.01),
        peers={"twice": sleeping(0.02), "half": sleeping(0.005)},
    )


def test_a_row_holds_the_ratio_of_times_and_the_share_of_the_bandwidth(slow_work):
    outcome = hold(slow_work)
    twice, half = outcome.rows
    assert (twice.work, twice.source, twice.peer, half.peer) == ("nothing", "uint16 2×64×64", "twice", "half")
    assert twice.ours_ms == half.ours_ms >= 10
    assert twice.ratio == pytest.approx(twice.peer_ms / twice.ours_ms)
    assert half.ratio == pytest.approx(half.peer_ms / half.ours_ms)
    assert half.peer_ms < twice.ours_ms < twice.peer_ms
    assert twice.input_gb_per_s == pytest.approx(16384 / twice.ours_ms / 1e6)
    # Half of the input's bytes are copied, the other half is read.
    traffic_ms = 8192 / outcome.copy_gb_per_s / 1e6 + 8192 / outcome.read_gb_per_s / 1e6
    assert twice.share_of_bandwidth == pytest.approx(traffic_ms / twice.ours_ms)
