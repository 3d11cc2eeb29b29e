"""The plots of the report: error against time, step and size, and transfer functions."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from volprep.plan.form_trial import FormTrial
from volprep.plan.probe import SHARE
from volprep.report.canvas import (
    DASHED,
    DOTTED,
    LIMIT,
    LONG,
    MARKERS,
    MUTED,
    PAGE,
    SERIES,
    SOLID,
    Axes,
    Axis,
    Plot,
    plot,
)
from volprep.report.text import ratio
from volprep.validation.comparison.colours import css_colour
from volprep.validation.results.measurements import LevelFloor, ProgramResult, Sweep, SweepPoint
from volprep.validation.results.report import Report
from volprep.validation.timing.turns import Milliseconds
from volprep.validation.verdicts.verdict import share_of_errors
from volprep_formats.arrays import Float64Array
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.transfer_function import TransferFunction

_COLOUR_STRIPS = 64
"""Pieces of a transfer function's area, each in one colour."""


@dataclass(frozen=True)
class DeviceCurve:
    """Error against time of one device."""

    label: str
    """Name in the legend."""
    front: tuple[tuple[float, float], ...]
    """Milliseconds and RMSE of the points that are joined, fastest first."""
    beside: tuple[tuple[float, float], ...]
    """The same values for unconnected points."""


def curves_against_time(curves: Sequence[DeviceCurve], tolerance_rmse: float) -> Plot:
    """RMSE against milliseconds per draw, a curve for each device."""
    return plot(lambda axes: _draw_curves(axes, curves, tolerance_rmse))


def error_against_time(program: ProgramResult, report: Report) -> Plot:
    """RMSE against milliseconds per draw: total and drawing error of the finest level, total error of the others."""
    return plot(lambda axes: _draw_error_against_time(axes, program.sweep, report))


def error_against_step(program: ProgramResult, report: Report) -> Plot:
    """RMSE against step size at the finest level, with the data error and a line of the expected order."""
    return plot(lambda axes: _draw_error_against_step(axes, program.sweep, report))


def error_against_size(report: Report) -> Plot | None:
    """Share of the tolerance against the size of the finest level, of all compressed forms; None without such forms.

    The share is the larger one of RMSE and largest error, as in the verdict. A lossless form has none.
    """
    forms = [form for form in report.forms if form.maximum > 0]
    return plot(lambda axes: _draw_error_against_size(axes, forms, report), 2.4) if forms else None


def transfer_plot(
    function: TransferFunction, window: tuple[float, float], unit: str, opaque_length_mm: float | None = None
) -> Plot:
    """Extinction per millimetre over physical value, the area in the function's colours.

    With `opaque_length_mm`, the opacity of that length.
    """
    return plot(lambda axes: _draw_transfer(axes, function, window, unit, opaque_length_mm), 1.7)


def _draw_error_against_time(axes: Axes, sweep: Sweep, report: Report) -> None:
    axes.logarithmic(
        "median milliseconds per draw", "RMSE over seen pixels", [point.total.seen_rmse for point in sweep.points]
    )
    levels = [floor.level for floor in sweep.floors]
    for position, level in enumerate(levels):
        points, colour = _timed(sweep, level), SERIES[position % len(SERIES)]
        for point, time in points:
            axes.plot([(end, point.total.seen_rmse) for end in (time.low, time.high)], colour)
        axes.plot(
            [(time.median, point.total.seen_rmse) for point, time in points],
            colour,
            f"level {level}: against truth",
            marker=MARKERS[position % len(MARKERS)],
            width=2.2 if position == 0 else 1.6,
        )
    finest = [((time.median, point.drawing.seen_rmse), point.step_ratio) for point, time in _timed(sweep, levels[0])]
    label = f"level {levels[0]}: drawing error alone"
    axes.plot([place for place, _ in finest], SERIES[0], label, marker="o", hollow=PAGE, dashes=DASHED)
    for place, step_ratio in finest:
        axes.text(place, ratio(step_ratio), 0, 16, "middle")
    _floor(axes, sweep.floors[0], report)
    axes.across(report.tolerance.rmse, LIMIT, DOTTED, "tolerance")


def _draw_curves(axes: Axes, curves: Sequence[DeviceCurve], tolerance_rmse: float) -> None:
    errors = [error for curve in curves for _, error in (*curve.front, *curve.beside)]
    axes.logarithmic("milliseconds per draw", "RMSE", errors)
    for position, curve in enumerate(curves):
        colour, marker = SERIES[position % len(SERIES)], MARKERS[position % len(MARKERS)]
        axes.plot(curve.front, colour, curve.label, marker=marker)
        axes.plot(curve.beside, colour, marker=marker, dashes=None, size=4.0, opacity=0.45)
    axes.across(tolerance_rmse, LIMIT, DOTTED, "tolerance")


def _draw_error_against_step(axes: Axes, sweep: Sweep, report: Report) -> None:
    points = sweep.of_level(sweep.floors[0].level)
    axes.logarithmic("step in millimetres", "RMSE over seen pixels", [point.total.seen_rmse for point in points])
    axes.plot([(point.step_mm, point.total.seen_rmse) for point in points], SERIES[0], "against truth", marker="o")
    drawing = [(point.step_mm, point.drawing.seen_rmse) for point in points]
    axes.plot(drawing, SERIES[0], "drawing error alone", marker="o", hollow=PAGE, dashes=DASHED)
    measured = [(point.step_mm, point.quadrature.seen_rmse) for point in points if point.quadrature is not None]
    if measured:
        axes.plot(measured, SERIES[1], "step and arithmetic alone", marker="s")
        step, error = max(measured)
        order = sweep.convergence.expected
        expected = [(point.step_mm, error * (point.step_mm / step) ** order) for point in points]
        axes.plot(expected, MUTED, f"order {order:g}", width=1.0, dashes=DOTTED, stretches=False)
    _floor(axes, sweep.floors[0], report)


def plain_bytes(manifest: Manifest) -> int:
    """Size of the finest level without compression: 8 bits of each value of a voxel."""
    in_colour = any(program.classification == "colour" for program in manifest.programs)
    return math.prod(manifest.levels[0].grid.shape_zyx) * (4 if in_colour else 1)


def _share(form: FormTrial, report: Report) -> float:
    """Return the part of the tolerance that a form takes."""
    share = share_of_errors(form.rmse, form.maximum, report.tolerance)
    if form.flip is None or not report.tolerance.flip:
        return share
    return max(share, form.flip / report.tolerance.flip)


def _draw_error_against_size(axes: Axes, forms: Sequence[FormTrial], report: Report) -> None:
    shares = {form: _share(form, report) for form in forms}
    axes.logarithmic("megabytes of the finest level", "error, share of the tolerance", shares.values())
    axes.x.margin, axes.y.margin = 0.25, 0.2
    for kept, label, series in ((True, "in the package", 0), (False, "refused", 1)):
        found = [(form.size_bytes / 1e6, shares[form]) for form in forms if form.kept == kept]
        if found:
            axes.plot(found, SERIES[series], label, marker=MARKERS[series], dashes=None)
    for number, form in enumerate(sorted(forms, key=shares.__getitem__)):
        name = form.format if form.channel is None else f"{form.channel}: {form.format}"
        # Beside each other, names of forms of one size would lie on each other.
        axes.text((form.size_bytes / 1e6, shares[form]), name, 7, -2 if number % 2 else 8)
    axes.down(plain_bytes(report.package.manifest) / 1e6, MUTED, LONG, "uncompressed")
    axes.across(1.0, LIMIT, SOLID, "tolerance")
    axes.across(SHARE, LIMIT, DOTTED, "half of the tolerance")


def _draw_transfer(
    axes: Axes, function: TransferFunction, window: tuple[float, float], unit: str, opaque_length_mm: float | None
) -> None:
    def height(extinctions: Float64Array) -> Float64Array:
        return extinctions if opaque_length_mm is None else -np.expm1(-extinctions * opaque_length_mm)

    points = (function.points[0], *function.points, function.points[-1])
    low, high = min(points[0].value, window[0]), max(points[-1].value, window[1])
    values = np.array([low, *(point.value for point in function.points), high])
    extinctions = np.array([point.extinction_per_mm for point in points])
    channels = np.array([point.colour for point in points]).T
    strips, colours = [], []
    for left, right in pairwise(np.linspace(low, high, _COLOUR_STRIPS + 1)):
        inside = np.unique(np.concatenate([[left, right], values[(values > left) & (values < right)]]))
        red, green, blue = (float(np.interp((left + right) / 2, values, channel)) for channel in channels)
        upper = np.column_stack([inside, height(np.interp(inside, values, extinctions))])
        strips.append([(left, 0.0), *upper, (right, 0.0)])
        colours.append(css_colour((red, green, blue)))
    axes.area(strips, colours)
    # Between two points extinction is a straight line, and opacity is not.
    numbers = np.arange(len(values))
    places = numbers if opaque_length_mm is None else np.linspace(0, numbers[-1], 16 * numbers[-1] + 1)
    heights = height(np.interp(places, numbers, extinctions))
    axes.plot([*zip(np.interp(places, numbers, values).tolist(), heights.tolist(), strict=True)], SERIES[0])
    axes.x = Axis(f"value in {unit}" if unit else "value", low=low, high=high)
    axes.y.label, axes.y.low = "extinction per mm" if opaque_length_mm is None else "opacity", 0.0
    axes.y.most_ticks = 4


def _timed(sweep: Sweep, level: int) -> list[tuple[SweepPoint, Milliseconds]]:
    """Return the points of a level that were timed, with their times."""
    return [(point, point.draw) for point in sweep.of_level(level) if point.draw is not None]


def _floor(axes: Axes, floor: LevelFloor, report: Report) -> None:
    """Draw the data error as a line, if it exceeds the oracle's own error."""
    if floor.data.seen_rmse >= report.oracle_tolerance:
        axes.across(floor.data.seen_rmse, MUTED, LONG, f"data error of level {floor.level}")
