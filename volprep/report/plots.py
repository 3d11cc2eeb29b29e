"""The plots of the report as inline SVG that takes its colours and its typeface from the page.

matplotlib draws with one marker colour per role, and these are replaced by the page's CSS variables, so that one plot
serves light and dark. Each plot exists in a wide and a narrow form; the page shows the one that fits the screen.
"""

import io
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from volprep.report.data import Sweep, SweepPoint
from volprep.report.text import ratio
from volprep_formats.package.manifest import Tolerance
from volprep_formats.package.transfer_function import TransferFunction

_INK, _MUTED, _LINE, _PAGE, _LIMIT = "#101112", "#202122", "#303132", "#404142", "#505152"
_SERIES = ("#510001", "#510002", "#510003", "#510004", "#510005", "#510006")
_VARIABLES = {
    _INK: "var(--ink)",
    _MUTED: "var(--muted)",
    _LINE: "var(--line)",
    _PAGE: "var(--card)",
    _LIMIT: "var(--bad)",
    **{marker: f"var(--series-{number})" for number, marker in enumerate(_SERIES, 1)},
}
_MARKERS = ("o", "s", "D", "^", "v", "P")
_WIDE_INCHES = (9.6, 4.4)
_NARROW_INCHES = (4.6, 4.4)


@dataclass(frozen=True)
class Plot:
    """One plot in its two forms."""

    wide: str
    """SVG for screens from 720 CSS pixels."""
    narrow: str
    """SVG for phones."""


def error_against_time(sweep: Sweep, tolerance: Tolerance, name: str) -> Plot:
    """RMSE against milliseconds per draw: total and drawing error of the finest level, total error of the others."""
    return _plot(lambda figure: _draw_error_against_time(figure.add_subplot(), sweep, tolerance), f"{name}-time")


def error_against_step(sweep: Sweep, name: str) -> Plot:
    """RMSE against step size at the finest level, with the data error and a line of the expected order."""
    return _plot(lambda figure: _draw_error_against_step(figure.add_subplot(), sweep), f"{name}-step")


def transfer_plot(function: TransferFunction, window: tuple[float, float], unit: str) -> Plot:
    """Extinction per millimetre over physical value."""
    return _plot(
        lambda figure: _draw_transfer(figure.add_subplot(), function, window, unit), f"{function.name}-transfer"
    )


def _draw_error_against_time(axes: Axes, sweep: Sweep, tolerance: Tolerance) -> None:
    _logarithmic(axes, "median milliseconds per draw", "RMSE")
    levels = [floor.level for floor in sweep.floors]
    for position, level in enumerate(levels):
        points = _of_level(sweep, level)
        axes.plot(
            [point.draw_ms for point in points],
            [point.total.rmse for point in points],
            color=_SERIES[position % len(_SERIES)],
            marker=_MARKERS[position % len(_MARKERS)],
            label=f"level {level}: against truth",
            linewidth=2.2 if position == 0 else 1.6,
        )
    finest = _of_level(sweep, levels[0])
    axes.plot(
        [point.draw_ms for point in finest],
        [point.drawing.rmse for point in finest],
        color=_SERIES[0],
        marker="o",
        markerfacecolor=_PAGE,
        linestyle=(0, (4, 2)),
        label=f"level {levels[0]}: drawing error alone",
    )
    for point in finest:
        axes.annotate(
            ratio(point.step_ratio),
            (point.draw_ms, point.drawing.rmse),
            xytext=(0, -13),
            textcoords="offset points",
            ha="center",
            color=_MUTED,
            fontsize=8.5,
        )
    _floor(axes, sweep.floors[0].data.rmse, f"data error of level {levels[0]}")
    axes.axhline(tolerance.rmse, color=_LIMIT, linewidth=1.4, linestyle=(0, (1, 2)), label="tolerance")
    _legend(axes)


def _draw_error_against_step(axes: Axes, sweep: Sweep) -> None:
    _logarithmic(axes, "step in millimetres", "RMSE")
    points = _of_level(sweep, sweep.floors[0].level)
    steps = [point.step_mm for point in points]
    axes.plot(steps, [point.total.rmse for point in points], color=_SERIES[0], marker="o", label="against truth")
    axes.plot(
        steps,
        [point.drawing.rmse for point in points],
        color=_SERIES[0],
        marker="o",
        markerfacecolor=_PAGE,
        linestyle=(0, (4, 2)),
        label="drawing error alone",
    )
    measured = [(point.step_mm, point.quadrature.rmse) for point in points if point.quadrature is not None]
    if measured:
        axes.plot(
            *zip(*measured, strict=True), color=_SERIES[1], marker="s", label="quadrature: float target, table apart"
        )
        step, error = max(measured)
        order = sweep.convergence.expected
        axes.plot(
            steps,
            [error * (other / step) ** order for other in steps],
            color=_MUTED,
            linewidth=1,
            linestyle=(0, (1, 2)),
            label=f"order {order:g}",
        )
    _floor(axes, sweep.floors[0].data.rmse, "data error")
    _legend(axes)


def _draw_transfer(axes: Axes, function: TransferFunction, window: tuple[float, float], unit: str) -> None:
    values = [point.value for point in function.points]
    extinctions = [point.extinction_per_mm for point in function.points]
    low, high = min(values[0], window[0]), max(values[-1], window[1])
    values, extinctions = [low, *values, high], [extinctions[0], *extinctions, extinctions[-1]]
    axes.fill_between(values, extinctions, color=_SERIES[0], alpha=0.15, linewidth=0)
    axes.plot(values, extinctions, color=_SERIES[0])
    axes.set_xlim(low, high)
    axes.set_ylim(bottom=0)
    axes.set_xlabel(f"value in {unit}" if unit else "value")
    axes.set_ylabel("extinction per mm")
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    _frame(axes)


def _of_level(sweep: Sweep, level: int) -> Sequence[SweepPoint]:
    return [point for point in sweep.points if point.level == level]


def _floor(axes: Axes, error: float, label: str) -> None:
    if error > 0:
        axes.axhline(error, color=_MUTED, linewidth=1.6, linestyle=(0, (6, 3)), zorder=1, label=label)


def _logarithmic(axes: Axes, x_label: str, y_label: str) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel(x_label)
    axes.set_ylabel(y_label)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if axis is axes.xaxis else (1.0, 3.0)))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.10f}".rstrip("0").rstrip(".")))
        axis.set_minor_formatter(NullFormatter())
    axes.margins(x=0.06, y=0.12)
    _frame(axes)


def _frame(axes: Axes) -> None:
    axes.grid(visible=True, which="major", color=_LINE, linewidth=0.8)
    axes.tick_params(which="both", colors=_MUTED, length=0)
    axes.xaxis.label.set_color(_INK)
    axes.yaxis.label.set_color(_INK)
    for side in axes.spines.values():
        side.set_visible(False)
    axes.set_facecolor("none")


def _legend(axes: Axes) -> None:
    columns = 3 if axes.bbox.width > 500 else 1  # pixels at 100 per inch: the wide form
    axes.legend(
        loc="upper center",
        bbox_to_anchor=(0.5, -0.16),
        ncols=columns,
        frameon=False,
        labelcolor=_INK,
        fontsize=9,
        handlelength=2.8,
    )


def _plot(draw: Callable[[Figure], None], name: str) -> Plot:
    return Plot(
        wide=_svg(draw, _WIDE_INCHES, f"{name}-wide"),
        narrow=_svg(draw, _NARROW_INCHES, f"{name}-narrow"),
    )


def _svg(draw: Callable[[Figure], None], inches: tuple[float, float], name: str) -> str:
    # A fixed salt and no date: the same numbers give the same bytes.
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": name, "font.size": 10}):
        figure = Figure(figsize=inches)
        figure.patch.set_visible(False)
        draw(figure)
        buffer = io.StringIO()
        nothing = dict.fromkeys(("Creator", "Date", "Format", "Type"))
        figure.savefig(buffer, format="svg", bbox_inches="tight", metadata=nothing)
    return _for_page(buffer.getvalue(), name)


def _for_page(svg: str, name: str) -> str:
    """Strip what only a file of its own needs, make ids unique in the page, and put the page's colours in."""
    body = svg[svg.index("<svg") :]
    body = re.sub(r"<metadata>.*?</metadata>", "", body, flags=re.DOTALL)
    body = re.sub(r'(id="|href="#|url\(#)', rf"\g<1>{name}-", body)
    body = re.sub(r'(<svg[^>]*?) width="[^"]*"', r"\1", body, count=1)
    body = re.sub(r'(<svg[^>]*?) height="[^"]*"', r'\1 aria-hidden="true"', body, count=1)
    for marker, variable in _VARIABLES.items():
        body = body.replace(marker, variable)
    return body
