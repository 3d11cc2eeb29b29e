"""Time spent in the parts of a validation."""

from volprep.validation.timing import clock as clocks
from volprep.validation.timing.clock import Clock


def test_time_in_which_a_part_runs_twice_counts_once(monkeypatch) -> None:
    times = iter((1.0, 2.0, 4.0, 8.0, 16.0))
    monkeypatch.setattr(clocks.time, "perf_counter", lambda: next(times))
    clock = Clock()
    one, other = clock.part("comparing"), clock.part("comparing")
    one.__enter__()
    other.__enter__()
    one.__exit__(None, None, None)
    other.__exit__(None, None, None)
    assert clock.so_far() == {"comparing": 7.0}
