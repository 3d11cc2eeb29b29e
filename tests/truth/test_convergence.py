import numpy as np
import pytest

from volprep.truth.convergence import fit_order

STEPS = 0.5 ** np.arange(10)


@pytest.mark.parametrize("order", [0.0, 1.0, 2.0, 3.5])
def test_a_pure_power_has_its_order_over_all_steps(order):
    found = fit_order(STEPS, 7.0 * STEPS**order)
    assert found.order == pytest.approx(order, abs=1e-12)
    assert (found.first, found.last) == (0, 9)


def test_a_plateau_before_the_settled_steps_is_reported():
    errors = np.minimum(0.02, 3.0 * STEPS**2 * (1 + 0.1 * STEPS))
    found = fit_order(STEPS, errors)
    assert found.order == pytest.approx(2.0, abs=0.01)
    assert found.first == 4
    assert found.last == 9


def test_errors_below_the_floor_do_not_count():
    rng = np.random.default_rng(0)
    errors = STEPS**2 + 1e-4 * rng.uniform(0, 1, 10)
    found = fit_order(STEPS, errors, floor=2e-3)
    assert found.order == pytest.approx(2.0, abs=0.1)
    assert found.last == 4


def test_unsettled_fine_steps_are_left_out():
    errors = STEPS**2.0
    errors[7:] = [3e-5, 6e-6, 9e-6]
    found = fit_order(STEPS, errors)
    assert found.order == pytest.approx(2.0)
    assert found.last == 6


def test_the_finest_settled_window_wins_over_a_longer_coarse_one():
    errors = np.concatenate([np.full(6, 0.3), 0.3 * 0.25 ** np.arange(1, 5)])
    assert fit_order(STEPS, errors).order == pytest.approx(2.0)


def test_an_error_that_settles_nowhere_has_no_order():
    errors = STEPS * np.where(np.arange(10) % 2, 4.0, 1.0)
    assert fit_order(STEPS, errors).order is None


def test_too_few_refinements_have_no_order():
    assert fit_order(STEPS[:3], STEPS[:3]).order is None
    assert fit_order(STEPS, np.zeros(10)).order is None
