"""What is said about the order of the quadrature error."""

import numpy as np
import pytest
from tiny_packages import function

from volprep.validation.timing.order import OrderFacts, convergence
from volprep_formats.package.transfer_function import TransferFunction

STEPS_MM = (1.0, 0.5, 0.25, 0.125, 0.0625, 0.03125)


def rising(*values: float) -> TransferFunction:
    return function(*((value, (1.0, 1.0, 1.0), float(i)) for i, value in enumerate(values)))


SMOOTH = OrderFacts(functions=[rising(0.0, 1.0)])


def of_order(order: float) -> list[float]:
    return [0.01 * step**order for step in STEPS_MM]


@pytest.mark.parametrize("order", [1.0, 2.0])
def test_the_order_is_seen(order) -> None:
    found = convergence(STEPS_MM, of_order(order), "rgba32f", SMOOTH)
    assert found.observed == pytest.approx(order)
    assert found.slopes == pytest.approx([order] * 5)
    assert found.fitted_steps_mm == STEPS_MM
    assert found.limits == ()


def test_steps_below_the_rounding_of_the_target_do_not_count() -> None:
    errors = [0.01 * step**3 for step in STEPS_MM]
    errors[-1] = 9e-7
    found = convergence(STEPS_MM, errors, "rgba32f", SMOOTH)
    assert found.observed == pytest.approx(3.0)
    assert found.fitted_steps_mm == STEPS_MM[:-1]


def test_a_half_float_target_ends_earlier() -> None:
    found = convergence(STEPS_MM, of_order(2.0), "rgba16f", SMOOTH)
    assert found.observed is None
    assert found.limits


def test_an_error_that_no_longer_falls_is_a_floor_and_no_order() -> None:
    found = convergence(STEPS_MM, [1e-3] * 6, "rgba32f", SMOOTH)
    assert found.observed is None
    assert "floor" in found.limits[-1]


def test_an_erratic_error_has_no_order() -> None:
    found = convergence(STEPS_MM, [1e-2, 1e-3, 9e-4, 1e-4, 9e-5, 1e-5], "rgba32f", SMOOTH)
    assert found.observed is None
    assert len(found.slopes) == 5


def test_a_jump_of_the_transfer_function_is_named_as_what_may_lower_the_order() -> None:
    found = convergence(STEPS_MM, of_order(2.0), "rgba32f", OrderFacts(functions=[rising(0.0, 0.5, 0.5, 1.0)]))
    assert "jump" in found.limits[0]


def test_without_a_float_target_there_is_no_order() -> None:
    found = convergence(STEPS_MM, [], None, SMOOTH)
    assert (found.observed, found.slopes) == (None, ())
    assert "float target" in found.limits[0]


def test_equal_pictures_have_no_slope() -> None:
    found = convergence(STEPS_MM, list(np.zeros(6)), "rgba32f", SMOOTH)
    assert (found.observed, found.slopes) == (None, ())


@pytest.mark.parametrize(("classification", "says"), [("preintegrated", "its entries"), ("palette", "has steps")])
def test_what_a_classification_does_to_the_order_is_said(classification, says) -> None:
    jump = rising(0.0, 0.5, 0.5, 1.0)
    (limit,) = OrderFacts(functions=[jump], classification=classification).limits
    assert says in limit
