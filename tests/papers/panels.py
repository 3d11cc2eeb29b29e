"""Several plots with the same curves in one figure, one for each scan."""

import io
import math

from .record import PaperCurves, PaperPicture, PaperPictures

_INCHES = (4.6, 3.4)
_COLUMNS = 2


def panels(title: str, figures: dict[str, PaperCurves], note: str = "") -> PaperPictures:
    """Return one picture with the curves of each scan; the vertical axis is logarithmic."""
    from matplotlib.figure import Figure

    columns = min(_COLUMNS, len(figures))
    rows = math.ceil(len(figures) / columns)
    figure = Figure(figsize=(_INCHES[0] * columns, _INCHES[1] * rows), dpi=120)
    figure.patch.set_facecolor("white")
    all_axes = figure.subplots(rows, columns, squeeze=False).flat
    for axes, (name, curves) in zip(all_axes, figures.items(), strict=False):
        for line in curves.lines:
            # Zero, the last frame, has no logarithm: it lies on the lower edge.
            axes.plot(*zip(*line.points, strict=True), marker=".", markersize=3, linewidth=1, label=line.label)
        axes.set_yscale("symlog", linthresh=1e-4)
        axes.set_title(name, fontsize=8)
        axes.set_xlabel(curves.x, fontsize=7)
        axes.set_ylabel(curves.y, fontsize=7)
        axes.tick_params(labelsize=6)
        axes.legend(fontsize=6)
    for axes in list(all_axes):
        axes.set_axis_off()
    figure.tight_layout()
    file = io.BytesIO()
    figure.savefig(file, format="png")
    return PaperPictures(title, (PaperPicture.of_png(", ".join(figures), file.getvalue()),), note)
