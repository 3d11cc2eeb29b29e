"""The order with which the quadrature error falls, and what may keep it from what theory expects."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from volprep.report.data import Convergence, Target
from volprep.truth.convergence import fit_order
from volprep_formats.package.transfer_function import TransferFunction

_NOISE: dict[Target, float] = {"rgba8": 1 / 510, "rgba16f": 2.0**-12, "rgba32f": 1e-6}
"""Root mean square errors below this are the target's rounding; in float32, that of some hundred samples."""


def convergence(
    steps_mm: Sequence[float],
    quadrature_rmse: Sequence[float],
    target: Target | None,
    function: TransferFunction,
    opacity_cutoff: float | None,
) -> Convergence:
    """Tell the order from errors into a float target, coarsest step first; `target` is None where there is none."""
    jumps = any(lower.value == upper.value for lower, upper in pairwise(function.points))
    limits = []
    if jumps:
        limits.append("The transfer function has a jump, and a step sees it late or early: order 1.")
    if opacity_cutoff is not None:
        limits.append(
            f"Rays that stop at opacity {opacity_cutoff:g} leave up to {1 - opacity_cutoff:.2g} of the light behind, "
            "whatever the step: a floor under the quadrature error."
        )
    expected = 1.0 if jumps else 2.0
    if target is None:
        limits.append("This driver has no float target: 8 bits hide the quadrature error.")
        return Convergence(expected=expected, slopes=(), observed=None, fitted_steps_mm=(), limits=tuple(limits))
    fit = fit_order(steps_mm, quadrature_rmse, _NOISE[target])
    if fit.order is None:
        limits.append("No three refinements agree on a slope.")
    return Convergence(
        expected=expected,
        slopes=_slopes(steps_mm, quadrature_rmse),
        observed=fit.order,
        fitted_steps_mm=tuple(steps_mm[fit.first : fit.last + 1]) if fit.order is not None else (),
        limits=tuple(limits),
    )


def _slopes(steps_mm: Sequence[float], errors: Sequence[float]) -> tuple[float, ...]:
    """Slopes between neighbouring steps, as far as there is an error to speak of."""
    return tuple(
        float(np.log(error / finer_error) / np.log(step / finer))
        for (step, error), (finer, finer_error) in pairwise(zip(steps_mm, errors, strict=True))
        if error > 0 and finer_error > 0
    )
