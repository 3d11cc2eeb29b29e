"""Measure the order of the quadrature error, and name possible reasons why it differs from theory."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from volprep.compositing import COMPOSITINGS
from volprep.techniques import TECHNIQUES
from volprep.truth.convergence import fit_order
from volprep.validation.results.measurements import Convergence, Target
from volprep_formats.package.program import ClassificationName, CompositingName, Lighting, TechniqueName
from volprep_formats.package.transfer_function import TransferFunction

_NOISE: dict[Target, float] = {"rgba8": 1 / 510, "rgba16f": 2.0**-12, "rgba32f": 2e-6}
"""Root mean square errors below this are rounding of the target; in float32, of some hundred samples."""

_OF_STEPS = 1.0
"""Order for a jump in the classified field: at every face between two labels, at every step of a palette."""
_TURNING: frozenset[Lighting] = frozenset(("phong", "blinn-phong"))
"""Lighting with jumps in colour: a light with a place lights the side of a surface that faces the viewer."""
_AGREEMENT = 0.25
"""Slopes of one view of a scan scatter by 0.2 even where they are settled."""
_LEAST_ORDER = 0.5
"""A slope below this is no order but a floor."""


@dataclass(frozen=True)
class OrderFacts:
    """Properties of a program that the order of its error depends on."""

    technique: TechniqueName = "ray-casting"
    compositing: CompositingName = "emission-absorption"
    classification: ClassificationName = "lookup"
    lighting: Lighting = "none"
    labels: bool = False
    """Whether voxels hold labels."""
    borders: bool = False
    """Whether the look of a scan with its segments jumps where labels meet."""
    functions: Sequence[TransferFunction] = ()
    """Transfer functions."""

    @property
    def order(self) -> float:
        """Expected order of the error under step refinement."""
        of_technique = TECHNIQUES[self.technique].order
        if of_technique is not None:
            return of_technique
        of_compositing = COMPOSITINGS[self.compositing].order
        has_steps = self.labels or self.borders or self.classification == "palette" or self.lighting in _TURNING
        return min(_OF_STEPS, of_compositing) if has_steps else of_compositing

    @property
    def limits(self) -> list[str]:
        """Possible reasons why the order is lower than theory has it, for people."""
        limits = [COMPOSITINGS[self.compositing].order_limit, TECHNIQUES[self.technique].order_limit]
        jumps = any(
            lower.value == upper.value for function in self.functions for lower, upper in pairwise(function.points)
        )
        if self.classification == "preintegrated":
            limits.append(
                "Between two entries of the pre-integrated table the function counts as constant: no step is better "
                "than its entries."
            )
        elif self.labels:
            limits.append(
                "Labels are constant in each voxel: segments of up to a voxel are split at its faces, which is exact; "
                "longer ones see a face between two labels late or early, with order 1."
            )
        elif self.classification == "palette":
            limits.append("A palette has steps: whatever does not resolve them sees them late or early, with order 1.")
        elif jumps:
            limits.append(
                "The transfer function has a jump, in the lookup table a steep ramp: steps that do not resolve it see "
                "it late or early, with order 1."
            )
        if self.lighting in _TURNING:
            limits.append(
                "A light with a place lights the side of a surface that faces the viewer: where a surface turns away "
                "its colour jumps, and steps see it late or early, with order 1."
            )
        if self.borders:
            limits.append(
                "Crisp borders of segments, and normals of lit ones, jump where labels meet: steps see that late or "
                "early, with order 1."
            )
        return [limit for limit in limits if limit is not None]


def convergence(
    steps_mm: Sequence[float], quadrature_rmse: Sequence[float], target: Target | None, facts: OrderFacts
) -> Convergence:
    """Fit the order to errors in a float target, coarsest step first; `target` is None without a float target."""
    limits = facts.limits
    if target is None:
        limits.append("The quadrature error was not measured: it needs a float target.")
        return Convergence(expected=facts.order, slopes=(), observed=None, fitted_steps_mm=(), limits=tuple(limits))
    fit = fit_order(steps_mm, quadrature_rmse, _NOISE[target], _AGREEMENT)
    order = fit.order
    if order is None:
        limits.append("No three refinements agree on a slope.")
    elif order < _LEAST_ORDER:
        limits.append("The finest steps no longer change the error: it is at the floor of float32 and texture filter.")
        order = None
    return Convergence(
        expected=facts.order,
        slopes=_slopes(steps_mm, quadrature_rmse),
        observed=order,
        fitted_steps_mm=tuple(steps_mm[fit.first : fit.last + 1]) if order is not None else (),
        limits=tuple(limits),
    )


def _slopes(steps_mm: Sequence[float], errors: Sequence[float]) -> tuple[float, ...]:
    """Slopes between neighbouring steps, as far as there is an error to speak of."""
    return tuple(
        float(np.log(error / finer_error) / np.log(step / finer))
        for (step, error), (finer, finer_error) in pairwise(zip(steps_mm, errors, strict=True))
        if error > 0 and finer_error > 0
    )
