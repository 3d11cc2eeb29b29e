"""Plots as inline SVG that takes its colours and its typeface from the page.

Colours are the page's CSS variables, so that one plot serves light and dark. Each plot exists in a wide and a narrow
form; the page shows the one that fits the screen. Lengths are in units of SVG, 72 for an inch.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from html import escape

from volprep.report.text import plain

INK, MUTED, _LINE, PAGE, LIMIT = (f"var(--{name})" for name in ("ink", "muted", "line", "card", "bad"))
SERIES = tuple(f"var(--series-{number})" for number in range(1, 7))
MARKERS = ("o", "s", "D", "^", "v", "P")
SOLID, DASHED, DOTTED, LONG = "", "6 3", "1.5 3", "9 4.5"
"""Patterns of lines."""
_MARKER_PATHS = {
    "s": "M-.9-.9h1.8v1.8h-1.8z",
    "D": "M0-1.3L1.3 0 0 1.3-1.3 0z",
    "^": "M0-1.1L1.1.9h-2.2z",
    "v": "M0 1.1L1.1-.9h-2.2z",
    "P": "M-.4-1.1h.8v.7h.7v.8h-.7v.7h-.8v-.7h-.7v-.8h.7z",
}
"""In half widths around the point; "o" is a circle."""
_LEFT, _RIGHT, _ABOVE, _BELOW = 58.0, 11.0, 7.0, 40.0
"""Room around the axes, for tick labels and axis labels."""
_LEGEND_ROW, _LEGEND_SAMPLE = 15.0, 34.0
_LETTER = 4.7
"""Width of a letter, about."""
_TICK_ROOM_XY = (44.0, 30.0)
"""Least distance of tick labels, about."""

Place = tuple[float, float]


@dataclass(frozen=True)
class Plot:
    """One plot in its two forms."""

    wide: str
    """SVG for screens from 720 CSS pixels."""
    narrow: str
    """SVG for phones."""


@dataclass
class Axis:
    """A horizontal or vertical axis."""

    label: str = ""
    logarithmic: bool = False
    margin: float = 0.05
    """Room on both sides of the values, as a part of their range."""
    low: float | None = None
    """Where it begins; None for the least value and the margin."""
    high: float | None = None
    """Where it ends; None for the largest value and the margin."""
    most_ticks: int = 9
    subdivisions: tuple[float, ...] = (1.0, 2.0, 5.0)
    """Ticks in each power of ten of a logarithmic axis."""
    values: list[float] = field(default_factory=list)
    """Values that the axis must show."""

    def place(self, value: float) -> float:
        """Return the place of a value: 0 at the beginning and 1 at the end."""
        first, last = self._ends()
        return (self._at(value) - first) / (last - first)

    def ticks(self, length: float, room: float) -> list[float]:
        """Return values for tick labels on an axis of this length, which are at least about `room` apart."""
        most = max(2, min(self.most_ticks, int(length / room)))
        first, last = self._ends()
        if self.logarithmic:
            powers = range(math.floor(first), math.ceil(last) + 1)
            for parts in (self.subdivisions, (1.0,)):
                found = [part * 10.0**power for power in powers for part in parts]
                found = [value for value in found if first <= math.log10(value) <= last]
                if 1 < len(found) <= most:
                    return found
            if len(found) > most:
                return found[:: -(-len(found) // most)]
            first, last = 10.0**first, 10.0**last
        step = _nice_step((last - first) / most)
        return [step * number for number in range(math.ceil(first / step), math.floor(last / step + 1e-9) + 1)]

    def _at(self, value: float) -> float:
        return math.log10(max(value, 1e-300)) if self.logarithmic else value

    def _ends(self) -> Place:
        shown = [self._at(value) for value in self.values if value > 0.0 or not self.logarithmic] or [0.0, 1.0]
        first, last = min(shown), max(shown)
        if first == last:
            apart = 0.3 if self.logarithmic else abs(first) / 20 or 1.0
            first, last = first - apart, last + apart
        room = self.margin * (last - first)
        low = first - room if self.low is None else self._at(self.low)
        high = last + room if self.high is None else self._at(self.high)
        return low, high if high > low else low + 1.0


def _nice_step(least: float) -> float:
    """Return the smallest of 1, 2, 2.5 and 5 times a power of ten that is at least so large."""
    power = 10.0 ** math.floor(math.log10(least))
    return next(step * power for step in (1.0, 2.0, 2.5, 5.0, 10.0) if step * power >= least * (1 - 1e-9))


@dataclass
class Axes:
    """Two axes, and the drawing between them. A list that is drawn later lies above the one before."""

    x: Axis = field(default_factory=Axis)
    y: Axis = field(default_factory=Axis)
    _marks: list[Callable[["_Scale"], str]] = field(default_factory=list)
    _legend: list[tuple[str, str]] = field(default_factory=list)
    """Sample, around (0, 0), and label."""

    def logarithmic(self, x_label: str, y_label: str, errors: Iterable[float]) -> None:
        """Label the axes and make them logarithmic; if all errors are 0, the vertical axis stays linear."""
        self.x = Axis(x_label, logarithmic=True, margin=0.06)
        self.y = Axis(y_label, any(error > 0.0 for error in errors), margin=0.12, subdivisions=(1.0, 3.0))

    def plot(
        self,
        points: Sequence[Place],
        colour: str,
        label: str | None = None,
        *,
        marker: str | None = None,
        hollow: str | None = None,
        dashes: str | None = SOLID,
        width: float = 1.5,
        size: float = 6.0,
        opacity: float = 1.0,
        stretches: bool = True,
    ) -> None:
        """Draw points, joined by a line unless `dashes` is None.

        Markers are filled with `hollow`, if it is given. Axes do not grow for points that do not `stretch` them.
        """
        if stretches:
            self.x.values += [x for x, _ in points]
            self.y.values += [y for _, y in points]
        line = "" if dashes is None else f"fill: none; stroke: {colour}; stroke-width: {width}; stroke-dasharray: "
        line = line and line + (dashes or "none")
        mark = None if marker is None else _marker(marker, colour, hollow or colour, size / 2, opacity)

        def drawn(scale: _Scale) -> str:
            places = [scale.place(point) for point in points]
            path = f'<path d="M{"L".join(f"{x:.2f} {y:.2f}" for x, y in places)}" style="{line}"/>' if line else ""
            return path + "".join(f'<g transform="translate({x:.2f} {y:.2f})">{mark}</g>' for x, y in places if mark)

        self._marks.append(drawn)
        if label is not None:
            self._legend.append(((f'<path d="M-13 0H13" style="{line}"/>' if line else "") + (mark or ""), label))

    def across(self, y: float, colour: str, dashes: str, label: str) -> None:
        """Draw a line over the whole width."""
        self.y.values.append(y)
        self._straight(lambda scale: f"M0 {scale.place((0.0, y))[1]:.2f}H{scale.width:.2f}", colour, dashes, label)

    def down(self, x: float, colour: str, dashes: str, label: str) -> None:
        """Draw a line over the whole height."""
        self.x.values.append(x)
        self._straight(lambda scale: f"M{scale.place((x, 0.0))[0]:.2f} 0V{scale.height:.2f}", colour, dashes, label)

    def _straight(self, path: Callable[["_Scale"], str], colour: str, dashes: str, label: str) -> None:
        style = f"stroke: {colour}; stroke-width: 1.5; stroke-dasharray: {dashes or 'none'}"
        self._marks.append(lambda scale: f'<path d="{path(scale)}" style="{style}"/>')
        self._legend.append((f'<path d="M-13 0H13" style="{style}"/>', label))

    def area(self, strips: Sequence[Sequence[Place]], colours: Sequence[str]) -> None:
        """Fill polygons, each with its colour."""

        def drawn(scale: _Scale) -> str:
            shapes = zip(strips, colours, strict=True)
            paths = ("L".join("{:.2f} {:.2f}".format(*scale.place(point)) for point in strip) for strip, _ in shapes)
            styles = (f"fill: {colour}; stroke: {colour}" for colour in colours)
            return "".join(f'<path d="M{path}z" style="{style}"/>' for path, style in zip(paths, styles, strict=True))

        self._marks.append(drawn)

    def text(self, place: Place, text: str, dx: float, dy: float, anchor: str = "start") -> None:
        """Write beside a point: to its left where there is no room on its right."""

        def drawn(scale: _Scale) -> str:
            x, y = scale.place(place)
            if anchor == "start" and x + dx + _LETTER * len(text) > scale.width:
                return _text(x - dx, y + dy, text, MUTED, 8.5, "end")
            return _text(x + dx, y + dy, text, MUTED, 8.5, anchor)

        self._marks.append(drawn)

    def svg(self, width: float, height: float, legend_columns: int) -> str:
        """Return a drawing with axes of this size and the legend below, in rows of up to so many entries."""
        scale = _Scale(self, width, height)
        longest = max((len(label) for _, label in self._legend), default=1)
        whole = width + _LEFT + _RIGHT
        columns = max(1, min(legend_columns, int(whole / (_LEGEND_SAMPLE + _LETTER * longest + 12))))
        rows = -(-len(self._legend) // columns)
        tall = height + _ABOVE + _BELOW + rows * _LEGEND_ROW
        # A drawing of its own cuts off all parts beyond the axes.
        return (
            f'<svg viewBox="0 0 {whole:g} {tall:g}" aria-hidden="true"><g transform="translate({_LEFT:g} {_ABOVE:g})">'
            f"{scale.frame()}"
            f'<svg width="{width:g}" height="{height:g}">{"".join(mark(scale) for mark in self._marks)}</svg></g>'
            f"{self._legend_below(whole, height + _ABOVE + _BELOW, columns)}</svg>"
        )

    def _legend_below(self, width: float, top: float, columns: int) -> str:
        entries = []
        for number, (sample, label) in enumerate(self._legend):
            row, column = divmod(number, columns)
            x, y = 10.0 + column * width / columns, top + (row + 0.4) * _LEGEND_ROW
            entries.append(f'<g transform="translate({x + 13:.2f} {y:.2f})">{sample}</g>')
            entries.append(_text(x + _LEGEND_SAMPLE, y + 3, label, INK, 9))
        return "".join(entries)


@dataclass(frozen=True)
class _Scale:
    """Axes of a size."""

    axes: Axes
    width: float
    height: float

    def place(self, point: Place) -> Place:
        """Return the place of a point in the drawing."""
        return self.axes.x.place(point[0]) * self.width, (1.0 - self.axes.y.place(point[1])) * self.height

    def frame(self) -> str:
        """Draw grid, ticks and labels."""
        x, y, grid = self.axes.x, self.axes.y, []
        for value in x.ticks(self.width, _TICK_ROOM_XY[0]):
            at = x.place(value) * self.width
            grid.append(f'<path d="M{at:.2f} 0V{self.height:g}" style="stroke: {_LINE}; stroke-width: 0.8"/>')
            grid.append(_text(at, self.height + 14, _tick(value), MUTED, 10, "middle"))
        for value in y.ticks(self.height, _TICK_ROOM_XY[1]):
            at = (1.0 - y.place(value)) * self.height
            grid.append(f'<path d="M0 {at:.2f}H{self.width:g}" style="stroke: {_LINE}; stroke-width: 0.8"/>')
            grid.append(_text(-5, at + 3.5, _tick(value), MUTED, 10, "end"))
        grid.append(_text(self.width / 2, self.height + 30, x.label, INK, 10, "middle"))
        turned = _text(0, 0, y.label, INK, 10, "middle")
        grid.append(f'<g transform="translate(-47 {self.height / 2:g}) rotate(-90)">{turned}</g>')
        return "".join(grid)


def plot(draw: Callable[[Axes], None], height_inches: float = 3.3) -> Plot:
    """Return the plot that `draw` draws, in both forms. Names in it may be foreign text."""
    axes = Axes()
    draw(axes)
    height = 72.0 * height_inches
    return Plot(wide=axes.svg(619.2, height, 3), narrow=axes.svg(273.6, height, 1))


def _tick(value: float) -> str:
    """Write a value without digits of rounding."""
    return plain(float(f"{value:.6g}"))


def _text(x: float, y: float, text: str, colour: str, size: float, anchor: str = "start") -> str:  # noqa: PLR0917
    style = f"fill: {colour}; font-size: {size:g}px; text-anchor: {anchor}"
    return f'<text x="{x:.2f}" y="{y:.2f}" style="{style}">{escape(text)}</text>'


def _marker(kind: str, colour: str, fill: str, radius: float, opacity: float) -> str:
    style = f"fill: {fill}; stroke: {colour}; opacity: {opacity:g}"
    if kind == "o":
        return f'<circle r="{radius:g}" style="{style}"/>'
    return (
        f'<path transform="scale({radius:g})" d="{_MARKER_PATHS[kind]}" style="{style}; stroke-width: {1 / radius:g}"/>'
    )
