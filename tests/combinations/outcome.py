"""Build the scene of a row, validate the package, and read everything a second time."""

from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal
from unittest.mock import patch

from volprep.pipeline.build import build, plan_build
from volprep.plan.item_kinds import BEYOND, LIT_CODES
from volprep.scene.request import load_request
from volprep.validation.folder import report_folder
from volprep.validation.results.report import Report
from volprep.validation.run import measure_package
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent

from .factors import Row, name_of, row_of
from .scenes import write_scene

_FAULTS = (
    *("changed", "differing", "shifted", "worse", "beyond"),
    *("unproved", "disagreeing", "contradicted", "unlike_paths"),
)
"""Fields of a verdict that name what is wrong."""

Result = Literal["within", "refused", "warned", "beyond", "failed"]


@dataclass(frozen=True)
class Outcome:
    """What came of a row."""

    name: str
    result: Result
    """"refused": by the plan, with a code. "warned": views are beyond the tolerance, also of later frames, or levels
    are worse than box means, and nothing else is wrong, and the build has said so and why. "beyond": the verdict is
    another one than "within"."""
    said: str
    """The code and message of a refusal, the warnings of the build, or what the verdict names."""


def outcome_of(row: Row, folder: Path, *, vtk: bool = False) -> Outcome:
    """Try a row in an empty folder. With `vtk`, VTK draws the scan, too, which takes two seconds more."""
    name, scene, package = name_of(row), write_scene(folder, row), folder / "scene.volpkg"
    try:
        build(load_request(scene), package, Silent())
    except VolprepError as error:
        refused = not error.code.startswith("VP9") and _plan_raises(scene) == error.code
        return Outcome(name, "refused" if refused else "failed", f"{error.code} {error}")
    except Exception as error:  # noqa: BLE001 - a fault of a combination may raise anything
        return Outcome(name, "failed", f"{type(error).__name__}: {error}")
    try:
        report = _report(package, folder, vtk=vtk)
    except Exception as error:  # noqa: BLE001 - as above
        return Outcome(name, "failed", f"validation: {type(error).__name__}: {error}")
    said, warned = _said(report), _warned(package)
    known = "; ".join(item.reason for item in warned)
    worse = {f"level {item.level} with {item.transfer}" for item in warned}
    named = [each for fault in _FAULTS for each in getattr(report.verdict, fault) if each not in worse]
    faults = [each for each in named if not each.startswith("frame ")]
    if known and said and not faults:
        return Outcome(name, "warned", f"{said}: {known}")
    return Outcome(name, "beyond" if said else "within", said)


def _warned(package: Path) -> list[PlanItem]:
    """Return the items in which the build says that errors are beyond the tolerance."""
    return [item for item in Package.open(package).manifest.plan if item.kind in {BEYOND, LIT_CODES}]


def outcome_of_name(name: str) -> Outcome:
    """Try a row by its name in a folder of its own, with VTK.

    A pool of new processes finds functions of a package's modules, but none of its `__main__`.
    """
    with TemporaryDirectory() as folder:
        return outcome_of(row_of(name), Path(folder), vtk=True)


def _plan_raises(scene: Path) -> str | None:
    """Return the code of the error that the plan of a scene raises."""
    try:
        plan_build(load_request(scene), Silent())
    except VolprepError as error:
        return error.code
    return None


def _report(package: Path, folder: Path, *, vtk: bool) -> Report:
    """Validate a package with the witness."""
    scratch = folder / "scratch"
    scratch.mkdir()
    with (
        report_folder(folder / "report") as report,
        patch("volprep.validation.witness.judge.has_pyvista", lambda: vtk),
        patch("volprep.validation.run.has_pyvista", lambda: False),
    ):
        return measure_package(package, report, scratch, Silent(), witness=True)


def _said(measured: Report) -> str:
    """Return what the verdict names; empty if it is within."""
    verdict = measured.verdict
    if verdict.passed:
        return ""
    named = [f"{fault}: {', '.join(found)}" for fault in _FAULTS if (found := getattr(verdict, fault))]
    if verdict.failed:
        named.append(f"{verdict.worst_view} of {verdict.worst_program}: {verdict.share:.2f} of the tolerance")
    assert measured.witness is not None
    differing = [each for each in measured.witness.checks if not each.passed]
    named += [f"{each.item}: {each.found:.3g} of {each.limit:.3g}" for each in differing]
    return "; ".join([verdict.code, *named])
