"""Plots of lines over two linear axes."""

from collections.abc import Sequence
from dataclasses import dataclass

from volprep.report.canvas import MARKERS, SERIES, Axes, Plot, plot


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
        axes.plot(line.points, colour, line.label, marker=marker, size=4)
    axes.x.label, axes.x.low, axes.y.label, axes.y.low = x, 0.0, y, 0.0
