"""How the report writes numbers."""

import pytest

from volprep.report import text


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (0.0, "0"),
        (0.00106, "0.00106"),
        (0.000123456, "0.000123"),
        (0.0000123456, "1.23·10⁻⁵"),
        (1.0, "1.00"),
        (303.4, "303"),
        (1677.2, "1 677"),
        (-2.5, "-2.50"),
        (0.09996, "0.1000"),
    ],
)
def test_a_number_has_three_digits_that_count(value, expected) -> None:
    assert text.number(value) == expected


@pytest.mark.parametrize(
    ("value", "expected"), [(0.02, "0.02"), (0.25, "0.25"), (1e-6, "10⁻⁶"), (2.5e-7, "2.5·10⁻⁷"), (160.0, "160")]
)
def test_a_number_that_somebody_chose_gets_no_more_digits(value, expected) -> None:
    assert text.plain(value) == expected


@pytest.mark.parametrize(
    ("count", "expected"),
    [
        (0, "0 B"),
        (999, "999 B"),
        (1000, "1.00 kB"),
        (999_499, "999 kB"),
        (40_406_000, "40.4 MB"),
        (3 * 10**12, "3 000 GB"),
    ],
)
def test_a_size_has_a_unit_that_keeps_it_short(count, expected) -> None:
    assert text.size(count) == expected


@pytest.mark.parametrize(("value", "expected"), [(4.0, "4×"), (1.0, "1×"), (0.125, "1⁄8×")])
def test_a_step_is_written_as_a_multiple_or_a_part(value, expected) -> None:
    assert text.ratio(value) == expected


@pytest.mark.parametrize(("value", "expected"), [(0.25, "0.250 s"), (59.4, "59.4 s"), (61.2, "1 min 1 s")])
def test_a_time_is_written_in_seconds_or_minutes(value, expected) -> None:
    assert text.seconds(value) == expected


def test_pictures_that_are_the_same_have_no_finite_signal_to_noise() -> None:
    assert text.decibel(None) == "∞"
    assert text.decibel(51.23) == "51.2"
