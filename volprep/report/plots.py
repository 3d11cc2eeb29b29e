"""The plots of the report: error against time, step and size, and transfer functions."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.ticker import FuncFormatter, MaxNLocator

from volprep.plan.form_trial import FormTrial
from volprep.plan.probe import SHARE
from volprep.report.canvas import LIMIT, MARKERS, MUTED, PAGE, SERIES, Plot, across, logarithmic, plot
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
    errors = [point.total.seen_rmse for point in sweep.points]
    logarithmic(axes, "median milliseconds per draw", "RMSE over seen pixels", errors)
    levels = [floor.level for floor in sweep.floors]
    for position, level in enumerate(levels):
        points = _timed(sweep, level)
        axes.errorbar(
            [time.median for _, time in points],
            [point.total.seen_rmse for point, _ in points],
            xerr=_quartiles([time for _, time in points]),
            color=SERIES[position % len(SERIES)],
            marker=MARKERS[position % len(MARKERS)],
            label=f"level {level}: against truth",
            linewidth=2.2 if position == 0 else 1.6,
        )
    finest = _timed(sweep, levels[0])
    axes.plot(
        [time.median for _, time in finest],
        [point.drawing.seen_rmse for point, _ in finest],
        color=SERIES[0],
        marker="o",
        markerfacecolor=PAGE,
        linestyle=(0, (4, 2)),
        label=f"level {levels[0]}: drawing error alone",
    )
    for point, time in finest:
        axes.annotate(
            ratio(point.step_ratio),
            (time.median, point.drawing.seen_rmse),
            xytext=(0, -13),
            textcoords="offset points",
            ha="center",
            color=MUTED,
            fontsize=8.5,
        )
    _floor(axes, sweep.floors[0], report)
    across(axes, report.tolerance.rmse, LIMIT, (1, 2), "tolerance")


def _draw_curves(axes: Axes, curves: Sequence[DeviceCurve], tolerance_rmse: float) -> None:
    errors = [error for curve in curves for _, error in (*curve.front, *curve.beside)]
    logarithmic(axes, "milliseconds per draw", "RMSE", errors)
    for position, curve in enumerate(curves):
        colour, marker = SERIES[position % len(SERIES)], MARKERS[position % len(MARKERS)]
        for points, label, line in ((curve.front, curve.label, "-"), (curve.beside, None, "none")):
            times, errors = [point[0] for point in points], [point[1] for point in points]
            size, alpha = (6.0, 1.0) if label else (4.0, 0.45)
            axes.plot(
                times, errors, label=label, linestyle=line, color=colour, marker=marker, markersize=size, alpha=alpha
            )
    axes.axhline(tolerance_rmse, color=LIMIT, linewidth=1.4, linestyle=(0, (1, 2)), label="tolerance")


def _draw_error_against_step(axes: Axes, sweep: Sweep, report: Report) -> None:
    points = _of_level(sweep, sweep.floors[0].level)
    steps, errors = [point.step_mm for point in points], [point.total.seen_rmse for point in points]
    logarithmic(axes, "step in millimetres", "RMSE over seen pixels", errors)
    axes.plot(steps, errors, color=SERIES[0], marker="o", label="against truth")
    axes.plot(
        steps,
        [point.drawing.seen_rmse for point in points],
        color=SERIES[0],
        marker="o",
        markerfacecolor=PAGE,
        linestyle=(0, (4, 2)),
        label="drawing error alone",
    )
    measured = [(point.step_mm, point.quadrature.seen_rmse) for point in points if point.quadrature is not None]
    if measured:
        axes.plot(*zip(*measured, strict=True), color=SERIES[1], marker="s", label="step and arithmetic alone")
        # The line of the expected order must not stretch the axis.
        axes.set_ylim(axes.get_ylim())
        step, error = max(measured)
        order = sweep.convergence.expected
        axes.plot(
            steps,
            [error * (other / step) ** order for other in steps],
            color=MUTED,
            linewidth=1,
            linestyle=(0, (1, 2)),
            label=f"order {order:g}",
        )
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
    logarithmic(axes, "megabytes of the finest level", "error, share of the tolerance", shares.values())
    for kept, label, series in ((True, "in the package", 0), (False, "refused", 1)):
        found = [form for form in forms if form.kept == kept]
        if found:
            axes.plot(
                [form.size_bytes / 1e6 for form in found],
                [shares[form] for form in found],
                color=SERIES[series],
                marker=MARKERS[series],
                linestyle="none",
                label=label,
            )
    for number, form in enumerate(sorted(forms, key=shares.__getitem__)):
        # Beside each other, names of forms of one size would lie on each other.
        axes.annotate(
            form.format if form.channel is None else f"{form.channel}: {form.format}",
            (form.size_bytes / 1e6, shares[form]),
            xytext=(7, 5 if number % 2 else -5),
            textcoords="offset points",
            va="center",
            color=MUTED,
            fontsize=8.5,
        )
    axes.margins(x=0.25, y=0.2)
    axes.axvline(
        plain_bytes(report.package.manifest) / 1e6,
        color=MUTED,
        linewidth=1.6,
        linestyle=(0, (6, 3)),
        label="uncompressed",
    )
    axes.axhline(1.0, color=LIMIT, linewidth=1.4, label="tolerance")
    axes.axhline(SHARE, color=LIMIT, linewidth=1.4, linestyle=(0, (1, 2)), label="half of the tolerance")


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
    # All strips at once: one call of fill_between for each took half of the time of the page.
    axes.add_collection(PolyCollection(strips, facecolors=colours, edgecolors=colours))
    # Between two points extinction is a straight line, and opacity is not.
    numbers = np.arange(len(values))
    places = numbers if opaque_length_mm is None else np.linspace(0, numbers[-1], 16 * numbers[-1] + 1)
    heights = height(np.interp(places, numbers, extinctions))
    axes.plot(np.interp(places, numbers, values), heights, color=SERIES[0])
    axes.set_xlim(low, high)
    axes.set_ylim(bottom=0)
    axes.set_axisbelow(True)
    axes.set_xlabel(f"value in {unit}" if unit else "value")
    axes.set_ylabel("extinction per mm" if opaque_length_mm is None else "opacity")
    axes.yaxis.set_major_locator(MaxNLocator(4))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def _timed(sweep: Sweep, level: int) -> list[tuple[SweepPoint, Milliseconds]]:
    """Return the points of a level that were timed, with their times."""
    return [(point, point.draw) for point in _of_level(sweep, level) if point.draw is not None]


def _quartiles(times: Sequence[Milliseconds]) -> tuple[list[float], list[float]]:
    """Return the distances of the quartiles from the medians, below and above."""
    return [time.median - time.low for time in times], [time.high - time.median for time in times]


def _of_level(sweep: Sweep, level: int) -> Sequence[SweepPoint]:
    return [point for point in sweep.points if point.level == level]


def _floor(axes: Axes, floor: LevelFloor, report: Report) -> None:
    """Draw the data error as a line, if it exceeds the oracle's own error."""
    if floor.data.seen_rmse >= report.oracle_tolerance:
        label = f"data error of level {floor.level}"
        across(axes, floor.data.seen_rmse, MUTED, (6, 3), label)
