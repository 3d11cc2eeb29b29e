"""The page of the stress cases, made from the report's data alone."""

from volprep.lab.stress.records import StressReport
from volprep.report.environment import environment


def stress_page(report: StressReport) -> str:
    """Write the page of `report` as HTML. The pictures that it shows lie beside it under the names in the report."""
    drawn = [result for result in report.results if result.drawings]
    template = environment(report.oracle_tolerance).get_template("stress.html.j2")
    return template.render(
        report=report,
        drawn=drawn,
        refused=[result for result in report.results if not result.drawings],
        faults=[(result.case, drawing) for result in drawn for drawing in result.drawings if not drawing.passed],
        failed=[result.case for result in report.results if not result.passed],
        ratios=[point.step_ratio for point in drawn[0].drawings[0].points] if drawn else [],
    )
