"""Page curves.html: the cost and the error of each choice, made from the curves' data alone."""

from volprep.lab.curves.plot import curve_plot
from volprep.lab.curves.records import COST_NAMES, Curve, CurvePoint, CurvesReport, plotted_cost
from volprep.report.environment import environment
from volprep.truth.oracle import DEFAULT_TOLERANCE


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
