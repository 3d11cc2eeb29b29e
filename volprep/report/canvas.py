"""Plots as inline SVG that takes its colours and its typeface from the page.

matplotlib draws with one marker colour per role, and these are replaced by the page's CSS variables, so that one plot
serves light and dark. Each plot exists in a wide and a narrow form; the page shows the one that fits the screen.
"""

import io
import re
import warnings
import zlib
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from volprep.report.text import plain

INK, MUTED, _LINE, PAGE, LIMIT = "#101112", "#202122", "#303132", "#404142", "#505152"
SERIES = ("#510001", "#510002", "#510003", "#510004", "#510005", "#510006")
_VARIABLES = {
    INK: "var(--ink)",
    MUTED: "var(--muted)",
    _LINE: "var(--line)",
    PAGE: "var(--card)",
    LIMIT: "var(--bad)",
    **{marker: f"var(--series-{number})" for number, marker in enumerate(SERIES, 1)},
}
MARKERS = ("o", "s", "D", "^", "v", "P")
_LEFT_INCHES, _RIGHT_INCHES, _ABOVE_INCHES, _BELOW_INCHES = 0.75, 0.15, 0.1, 0.55
"""Room around the axes, for tick labels and axis labels."""
_LEGEND_ROW_INCHES = 0.21


@dataclass(frozen=True)
class Plot:
    """One plot in its two forms."""

    wide: str
    """SVG for screens from 720 CSS pixels."""
    narrow: str
    """SVG for phones."""


def plot(draw: Callable[[Axes], None], height_inches: float = 3.3) -> Plot:
    """Return the plot that `draw` draws, in both forms. Names in it may be foreign text."""
    return Plot(
        wide=_svg(draw, axes_inches=(8.6, height_inches), legend_columns=3),
        narrow=_svg(draw, axes_inches=(3.8, height_inches), legend_columns=1),
    )


def _svg(draw: Callable[[Axes], None], *, axes_inches: tuple[float, float], legend_columns: int) -> str:
    """Draw into axes of this size, with the legend below: its entries in rows of `legend_columns`."""
    # A fixed salt and no date: the same numbers give the same bytes. Dollars in a name begin no formula.
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": "volprep", "font.size": 10, "text.parse_math": False}):
        figure = Figure()
        figure.patch.set_visible(False)
        axes = figure.add_subplot()
        draw(axes)
        _frame(axes)
        handles, labels = axes.get_legend_handles_labels()
        below_inches = _BELOW_INCHES + _LEGEND_ROW_INCHES * -(-len(handles) // legend_columns)
        width, height = axes_inches[0] + _LEFT_INCHES + _RIGHT_INCHES, axes_inches[1] + below_inches + _ABOVE_INCHES
        figure.set_size_inches(width, height)
        axes.set_position(
            (_LEFT_INCHES / width, below_inches / height, axes_inches[0] / width, axes_inches[1] / height)
        )
        if handles:
            figure.legend(
                handles,
                labels,
                loc="lower center",
                borderaxespad=0.0,
                ncols=legend_columns,
                frameon=False,
                labelcolor=INK,
                fontsize=9,
                handlelength=2.8,
            )
        buffer = io.StringIO()
        with warnings.catch_warnings():
            # Browsers have letters that the font here lacks.
            warnings.filterwarnings("ignore", "Glyph .* missing from font")
            figure.savefig(buffer, format="svg", metadata=dict.fromkeys(("Creator", "Date", "Format", "Type")))
    return _for_page(buffer.getvalue())


def _for_page(svg: str) -> str:
    """Remove the parts that only a stand-alone file needs, make ids unique in the page, and use the page's colours."""
    number = zlib.crc32(svg.encode())
    body = svg[svg.index("<svg") :]
    body = re.sub(r"<metadata>.*?</metadata>", "", body, flags=re.DOTALL)
    body = re.sub(r'(id="|href="#|url\(#)', rf"\g<1>{number}-", body)
    body = re.sub(r'(<svg[^>]*?) width="[^"]*"', r"\1", body, count=1)
    body = re.sub(r'(<svg[^>]*?) height="[^"]*"', r'\1 aria-hidden="true"', body, count=1)
    for marker, variable in _VARIABLES.items():
        body = body.replace(marker, variable)
    return body


def logarithmic(axes: Axes, x_label: str, y_label: str, errors: Iterable[float]) -> None:
    """Label the axes and make them logarithmic; if all errors are 0, the vertical axis stays linear."""
    axes.set_xscale("log")
    if any(error > 0.0 for error in errors):
        axes.set_yscale("log")
    axes.set_xlabel(x_label)
    axes.set_ylabel(y_label)
    for axis in (axes.xaxis, axes.yaxis):
        if axis.get_scale() == "log":
            axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if axis is axes.xaxis else (1.0, 3.0)))
        axis.set_major_formatter(FuncFormatter(lambda value, _: plain(float(f"{value:.3g}"))))
        axis.set_minor_locator(NullLocator())
    axes.margins(x=0.06, y=0.12)


def across(axes: Axes, y: float, colour: str, dashes: tuple[int, int], label: str) -> None:
    """Draw a line over the whole width. Unlike axhline, this does not first fix the limits of a single point."""
    across = axes.get_yaxis_transform()
    axes.plot([0.0, 1.0], [y, y], transform=across, color=colour, linewidth=1.5, linestyle=(0, dashes), label=label)


def _frame(axes: Axes) -> None:
    axes.grid(visible=True, which="major", color=_LINE, linewidth=0.8)
    axes.tick_params(which="both", colors=MUTED, length=0)
    axes.xaxis.label.set_color(INK)
    axes.yaxis.label.set_color(INK)
    for side in axes.spines.values():
        side.set_visible(False)
    axes.set_facecolor("none")
