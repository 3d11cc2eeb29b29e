"""Page curves.html: the cost and the error of each choice, made from the curves' data alone."""

from collections.abc import Iterator, Sequence
from itertools import pairwise

from volprep.lab.curves.records import COST_NAMES, Curve, CurvePoint, CurvesReport, plotted_cost
from volprep.report.canvas import DOTTED, INK, LIMIT, MARKERS, MUTED, SERIES, Axes, Plot, plot
from volprep.report.environment import environment
from volprep.truth.oracle import DEFAULT_TOLERANCE

_MOST_LABELS = 10
"""Largest number of points that are all labelled; above it only the important ones have a label."""


def curve_plot(curve: Curve, allowed_rmse: float) -> Plot:
    """RMSE against the cost of a choice, with the Pareto front, and a ring around the package's variant."""
    return plot(lambda axes: _draw_curve(axes, curve, allowed_rmse))


def _draw_curve(axes: Axes, curve: Curve, allowed_rmse: float) -> None:
    axes.logarithmic(COST_NAMES[curve.cost], "RMSE over seen pixels", [point.errors.rmse for point in curve.points])
    series = list(dict.fromkeys(point.series for point in curve.points))
    one_each = len(series) == len(curve.points)
    if curve.cost == "milliseconds":
        for point in curve.points:
            axes.plot([(end, point.errors.rmse) for end in (point.wall.low, point.wall.high)], MUTED, width=0.8)
    front = sorted((plotted_cost(point, curve.cost), point.errors.rmse) for point in curve.points if point.on_front)
    axes.plot([*_steps(front)], INK, "Pareto front", width=1.6)
    for number, name in enumerate(series):
        points = sorted((point for point in curve.points if point.series == name), key=lambda point: point.step_mm)
        axes.plot(
            [(plotted_cost(point, curve.cost), point.errors.rmse) for point in points],
            SERIES[0 if one_each else number % len(SERIES)],
            None if one_each else name,
            # With more series than colours, series of one colour get different markers.
            marker=MARKERS[0 if one_each else (number + number // len(SERIES)) % len(MARKERS)],
            width=1.2,
        )
    for number, point in enumerate(sorted(curve.points, key=lambda point: point.errors.rmse)):
        place = (plotted_cost(point, curve.cost), point.errors.rmse)
        if point.chosen:
            axes.plot([place], LIMIT, "in the package", marker="o", size=15, hollow="none", dashes=None)
        if one_each and (len(curve.points) <= _MOST_LABELS or point.on_front or point.chosen):
            axes.text(place, point.label, 8, -3 if number % 2 else 9)
    axes.across(allowed_rmse, LIMIT, DOTTED, "tolerance")
    if one_each:
        axes.x.margin = 0.18


def _steps(points: Sequence[tuple[float, float]]) -> Iterator[tuple[float, float]]:
    """Return the corners of a line that falls at each point."""
    for (_, before), (x, y) in pairwise([points[0], *points]):
        yield from ((x, before), (x, y))


def curves_page(report: CurvesReport) -> str:
    """Write the page of the curves as HTML; it needs nothing from outside."""
    drawn = [curve for curve in report.curves if curve.points]
    return (
        environment(DEFAULT_TOLERANCE)
        .get_template("curves.html.j2")
        .render(
            report=report,
            drawn=drawn,
            missing=[curve for curve in report.curves if not curve.points],
            plots={curve.name: curve_plot(curve, report.tolerance.rmse) for curve in drawn},
            sorted_points={
                curve.name: sorted(curve.points, key=lambda point: plotted_cost(point, curve.cost)) for curve in drawn
            },
            findings={curve.name: _finding(curve) for curve in drawn},
            cost_names=COST_NAMES,
            data_file="curves.json",
        )
    )


def _finding(curve: Curve) -> str:
    """Say whether the package's variant is on the front, and which variant beats it if not."""
    chosen = next((point for point in curve.points if point.chosen), None)
    if chosen is None:
        return "The variant of the package was not drawn."
    if chosen.on_front:
        return f"The package has {chosen.label}: nothing here costs less and is as near to the truth."
    cost = plotted_cost(chosen, curve.cost)
    better = [
        point
        for point in curve.points
        if point.on_front and plotted_cost(point, curve.cost) <= cost and point.errors.rmse <= chosen.errors.rmse
    ]
    names = " and ".join(f"{point.label} ({_compared(point, chosen, curve)})" for point in better)
    return f"The package has {chosen.label}. Nearer to the truth for no more: {names}."


def _compared(point: CurvePoint, chosen: CurvePoint, curve: Curve) -> str:
    cost = plotted_cost(point, curve.cost) / plotted_cost(chosen, curve.cost)
    error = point.errors.rmse / chosen.errors.rmse
    return f"{cost:.0%} of the cost, {error:.0%} of the error"
