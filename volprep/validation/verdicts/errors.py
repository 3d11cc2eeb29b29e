"""The error for each failed verdict: its code, the numbers, and how to fix it."""

from collections.abc import Callable
from pathlib import Path

from volprep.truth.verdict_code import VerdictCode
from volprep.validation.exact.findings import error_of
from volprep.validation.results.report import Report
from volprep_formats.diagnostics import VolprepError


def error_of_verdict(report: Report, package: Path, folder: Path) -> VolprepError | None:
    """Return why the package at `package` may not ship; None if it may. The report lies in `folder`."""
    make = _ERRORS.get(report.verdict.code)
    return None if make is None else make(report, package, folder)


def _differs(report: Report, package: Path, _: Path) -> VolprepError:
    assert report.derivation is not None  # noqa: S101 - what differs was found by deriving
    return error_of(report.derivation.findings, package)


def _unproved(report: Report, package: Path, _: Path) -> VolprepError:
    return VolprepError("VP6032", path=package, listed=", ".join(report.verdict.unproved))


def _changed(report: Report, package: Path, folder: Path) -> VolprepError:
    return VolprepError("VP6015", path=package, programs=", ".join(report.verdict.changed), report=folder)


def _disagrees(report: Report, package: Path, folder: Path) -> VolprepError:
    return VolprepError("VP6042", path=package, programs=", ".join(report.verdict.disagreeing), report=folder)


def _contradicted(report: Report, package: Path, folder: Path) -> VolprepError:
    return VolprepError("VP6060", path=package, listed=", ".join(report.verdict.contradicted), report=folder)


def _unlike_paths(report: Report, package: Path, folder: Path) -> VolprepError:
    rmse = max(light.rmse for program in report.programs for light in program.traced_lights if not light.passed)
    programs = ", ".join(report.verdict.unlike_paths)
    return VolprepError(
        "VP3242", path=package, report=folder, programs=programs, rmse=rmse, allowed=report.tolerance.rmse
    )


def _shifted(report: Report, package: Path, folder: Path) -> VolprepError:
    others = [other for program in report.programs for other in program.others]
    most = max(other.shift_voxels for other in others)
    return VolprepError("VP6071", path=package, listed=", ".join(report.verdict.shifted), shift=most, report=folder)


def _worse(report: Report, package: Path, folder: Path) -> VolprepError:
    return VolprepError("VP6070", path=package, listed=", ".join(report.verdict.worse), report=folder)


def _part_beyond(report: Report, package: Path, folder: Path) -> VolprepError:
    return VolprepError("VP6035", path=package, listed=", ".join(report.verdict.beyond), report=folder)


def _beyond(report: Report, package: Path, folder: Path) -> VolprepError:
    verdict, allowed = report.verdict, report.tolerance
    fields = {
        "path": package,
        "failed": verdict.failed,
        "views": verdict.views,
        "view": verdict.worst_view,
        "program": verdict.worst_program,
        "rmse": verdict.worst_rmse,
        "rmse_allowed": allowed.rmse,
        "maximum": verdict.worst_maximum,
        "maximum_allowed": allowed.maximum,
        "flip": verdict.worst_flip,
        "flip_allowed": allowed.flip,
        "kept": "all" if verdict.worst_kept_light is None else f"{verdict.worst_kept_light:.3g}",
        "kept_allowed": allowed.kept_light,
        "report": folder,
    }
    sweep = next(measured.sweep for measured in report.programs if measured.program == verdict.worst_program)
    parts = sweep.breakdown
    if parts.texels is not None and parts.angle is not None and parts.target is not None:
        of_slices = {"texels": parts.texels.rmse, "angle": parts.angle.rmse, "target": parts.target.rmse}
        return VolprepError("VP6016", **fields, **of_slices, part_view=sweep.view)
    return VolprepError("VP6011", **fields, data=verdict.worst_data_rmse, drawing=verdict.worst_drawing_rmse)


_ERRORS: dict[VerdictCode, Callable[[Report, Path, Path], VolprepError]] = {
    "differs": _differs,
    "unproved": _unproved,
    "contradicted": _contradicted,
    "beyond": _beyond,
    "changed": _changed,
    "disagrees": _disagrees,
    "unlike-paths": _unlike_paths,
    "shifted": _shifted,
    "worse-than-box": _worse,
    "part-beyond": _part_beyond,
}
