"""Plots of lines over two linear axes."""

from collections.abc import Sequence
from dataclasses import dataclass

from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter

from volprep.report.canvas import MARKERS, SERIES, Plot, plot


@dataclass(frozen=True)
class Line:
    """Points that are joined."""

    label: str
    """Name in the legend."""
    points: tuple[tuple[float, float], ...]
    """Horizontal and vertical place of each."""


def line_plot(lines: Sequence[Line], x: str, y: str) -> Plot:
    """Lines over two linear axes that begin at 0, with the names of the axes."""
    return plot(lambda axes: _draw_lines(axes, lines, x, y))


def _draw_lines(axes: Axes, lines: Sequence[Line], x: str, y: str) -> None:
    for number, line in enumerate(lines):
        colour, marker = SERIES[number % len(SERIES)], MARKERS[number // len(SERIES) % len(MARKERS)]
        axes.plot(*zip(*line.points, strict=True), color=colour, marker=marker, markersize=4, label=line.label)
    axes.set_xlim(left=0)
    axes.set_ylim(bottom=0)
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
