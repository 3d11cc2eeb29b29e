"""Page ablation.html: the value of each item of a package, made from the measurement alone."""

from volprep.lab.ablation.records import FAULTS, Ablation, name_of
from volprep.report.environment import environment
from volprep.truth.oracle import DEFAULT_TOLERANCE

_CLOCKS = {"wall": "the clock on the wall", "processor": "the processor's time, because the driver draws with it"}


def ablation_page(found: Ablation) -> str:
    """Write the page as HTML; it needs nothing from outside."""
    return (
        environment(DEFAULT_TOLERANCE)
        .get_template("ablation.html.j2")
        .render(
            found=found,
            kept=[row for row in found.rows if row.kept],
            left_out=[row for row in found.rows if not row.kept],
            name_of=name_of,
            faults=FAULTS,
            clock=_CLOCKS[found.clock],
            summary=_summary(found),
            data_file="ablation.json",
        )
    )


def _summary(found: Ablation) -> str:
    """Describe the outcome in a sentence or two."""
    wrong = found.faults
    judged = [row for row in found.rows if row.other is not None or row.kept]
    verdict = (
        f"Of {len(judged)} items the plan is wrong, by its own measure, about {', '.join(wrong)}."
        if wrong
        else f"The plan is right about all {len(judged)} items that could be judged."
    )
    everything = found.everything
    if everything is None or everything.ratio is None:
        return verdict
    upload = everything.upload_bytes / max(found.planned.upload_bytes, 1)
    package = everything.package_bytes / max(found.planned.package_bytes, 1)
    return (
        f"{verdict} With everything at once the package has {package:.1f} times the bytes, an app uploads "
        f"{upload:.1f} times the bytes, and a picture takes {everything.ratio.median:.2f} times as long."
    )
