"""Find the sizes of pictures that coarse levels are right for: the report beside a package has them, not the package.

A package is made before it is validated, and the same scan gives the same bytes.
"""

from pathlib import Path

from volprep.validation.folder import DATA_FILE, default_report_path, is_report_of


def right_up_to_pixels(package: Path) -> dict[int, int | None]:
    """Return the size of the largest pictures within the tolerance of each coarse level; None if no measured size is.

    The smallest counts if several transfer functions or programs draw a level. Returns nothing without a report beside
    the package, or if it is of another package or of another version of volprep.
    """
    folder = default_report_path(package)
    if not is_report_of(folder, package):
        return {}
    # Only here: verbs that find no report load it for nothing.
    from pydantic import ValidationError  # noqa: PLC0415

    from volprep.validation.results.report import Report  # noqa: PLC0415

    try:
        report = Report.model_validate_json((folder / DATA_FILE).read_bytes())
    except ValidationError:
        return {}
    found: dict[int, int | None] = {}
    for program in report.programs:
        for other in program.others:
            if other.level is not None and other.sizes:
                sizes = [other.right_up_to_pixels, *([found[other.level]] if other.level in found else [])]
                found[other.level] = None if None in sizes else min(size for size in sizes if size is not None)
    return found
