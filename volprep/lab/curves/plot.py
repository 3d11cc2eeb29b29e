"""The plot of a choice: error against cost, with the Pareto front."""

from matplotlib.axes import Axes

from volprep.lab.curves.records import COST_NAMES, Curve, plotted_cost
from volprep.report.canvas import INK, LIMIT, MARKERS, MUTED, SERIES, Plot, logarithmic, plot

_MOST_LABELS = 10
"""Largest number of points that are all labelled; above it only the important ones have a label."""


def curve_plot(curve: Curve, allowed_rmse: float) -> Plot:
    """RMSE against the cost of a choice, with the Pareto front, and a ring around the package's variant."""
    return plot(lambda axes: _draw_curve(axes, curve, allowed_rmse))


def _draw_curve(axes: Axes, curve: Curve, allowed_rmse: float) -> None:
    logarithmic(axes, COST_NAMES[curve.cost], "RMSE over seen pixels", [point.errors.rmse for point in curve.points])
    series = list(dict.fromkeys(point.series for point in curve.points))
    one_each = len(series) == len(curve.points)
    for number, name in enumerate(series):
        points = sorted((each for each in curve.points if each.series == name), key=lambda each: each.step_mm)
        costs = [plotted_cost(point, curve.cost) for point in points]
        axes.plot(
            costs,
            [point.errors.rmse for point in points],
            color=SERIES[0 if one_each else number % len(SERIES)],
            # With more series than colours, series of one colour get different markers.
            marker=MARKERS[0 if one_each else (number + number // len(SERIES)) % len(MARKERS)],
            linewidth=1.2,
            label=None if one_each else name,
        )
        if curve.cost == "milliseconds":
            for point in points:
                span = (point.wall.low, point.wall.high)
                axes.plot(span, [point.errors.rmse] * 2, color=MUTED, linewidth=0.8, zorder=1)
    front = sorted((plotted_cost(each, curve.cost), each.errors.rmse) for each in curve.points if each.on_front)
    axes.step(*zip(*front, strict=True), where="post", color=INK, linewidth=1.6, label="Pareto front", zorder=1.5)
    for number, point in enumerate(sorted(curve.points, key=lambda each: each.errors.rmse)):
        if point.chosen:
            place = (plotted_cost(point, curve.cost), point.errors.rmse)
            axes.plot(*place, "o", markersize=15, markerfacecolor="none", color=LIMIT, label="in the package")
        if one_each and (len(curve.points) <= _MOST_LABELS or point.on_front or point.chosen):
            axes.annotate(
                point.label,
                (plotted_cost(point, curve.cost), point.errors.rmse),
                xytext=(8, 6 if number % 2 else -6),
                textcoords="offset points",
                va="center",
                color=MUTED,
                fontsize=8.5,
            )
    axes.axhline(allowed_rmse, color=LIMIT, linewidth=1.4, linestyle=(0, (1, 2)), label="tolerance")
    if one_each:
        axes.margins(x=0.18)
