"""Packages: planned, built, opened, checked and validated."""

from os import PathLike
from pathlib import Path
from typing import Literal, Unpack

from volprep.library.choices import SourceChoices, source_of
from volprep.pipeline.build import build, plan_build
from volprep.plan.records import Plan
from volprep.report.validate import validate
from volprep.scene.request import Request, request_of
from volprep.validation.folder import default_report_path
from volprep.validation.records import Report
from volprep_formats.package.check import Finding, check
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.reader import Package
from volprep_formats.progress import Progress, Silent


def plan_package(
    scene: str | PathLike[str],
    *,
    profile: str | None = None,
    preset: str | None = None,
    grid_size: Literal["auto"] | int | None = None,
    progress: Progress | None = None,
    **choices: Unpack[SourceChoices],
) -> Plan:
    """Return what a package of a scene or scan would hold, why, and what it costs. Nothing is written.

    `items` of the plan has one record for each decision: name, reason, size. The arguments are those of
    `build_package`, and it raises the same.
    """
    return plan_build(_request(scene, profile, preset, grid_size, choices), progress or Silent())


def build_package(
    scene: str | PathLike[str],
    package: str | PathLike[str],
    *,
    profile: str | None = None,
    preset: str | None = None,
    grid_size: Literal["auto"] | int | None = None,
    progress: Progress | None = None,
    **choices: Unpack[SourceChoices],
) -> Manifest:
    """Build the package of a scene or scan, and return its manifest.

    Parameters
    ----------
    scene
        Scene file, which ends in .toml, or a scan alone, drawn as its values suggest.
    package
        Where the package goes. An older package there stays until the new one is whole.
    profile
        Class of devices, or the path of a profile; if absent, the scene's.
    preset
        Transfer function that comes with volprep, in place of the scene's; `list_presets` names them.
    grid_size
        Size of the sub-volumes in voxels, or "auto" to cut only what the profile cannot hold whole; if absent, as the
        scene says.
    progress
        Who is told how far it is; nobody if absent.
    choices
        What of the source is meant, with the keys of [source] in a scene; they replace the scene's.

    Raises
    ------
    VolprepError
        VP9010 for a choice that a source cannot have, VP1xxx and VP2xxx for the scan, VP30xx for scene, profile and
        preset, VP402x and VP404x for what cannot be written.
    """
    request = _request(scene, profile, preset, grid_size, choices)
    return build(request, Path(package), progress or Silent())


def validate_package(
    package: str | PathLike[str],
    *,
    source: str | PathLike[str] | None = None,
    report: str | PathLike[str] | None = None,
    size: int | None = None,
    progress: Progress | None = None,
) -> Report:
    """Prove a package against its scan, write the report, and return what it says.

    `verdict.passed` of the result says whether the package may ship. `source` is the scan, if PACKAGE.origin.json does
    not name it. `report` is the folder of the report; if absent, NAME.report beside the package. `size` is the width
    and height of the pictures; if absent, as the scene says. Raises what `volprep validate` fails with, except that a
    package beyond its tolerance is no error here.
    """
    path = Path(package)
    return validate(
        path,
        default_report_path(path) if report is None else Path(report),
        progress or Silent(),
        source=None if source is None else Path(source),
        picture_size=size,
    )


def check_package(package: str | PathLike[str]) -> list[Finding]:
    """Return all that is wrong with the files of a package, nothing for a whole one. It needs no scan and no OpenGL."""
    return check(Path(package))


def open_package(package: str | PathLike[str]) -> Package:
    """Open a package, a folder or a zip: its manifest, and its files by name. Raises VP40xx for an unsound one."""
    return Package.open(Path(package))


def _request(
    scene: str | PathLike[str],
    profile: str | None,
    preset: str | None,
    grid_size: Literal["auto"] | int | None,
    choices: SourceChoices,
) -> Request:
    request = request_of(Path(scene), profile)
    if choices:
        # Paths in the choices start at the current folder, those of the scene at the scene's.
        meant = source_of(Path(), choices)
        request = request.with_source(**{key: getattr(meant, key) for key in choices})
    if preset is not None:
        request = request.with_preset(preset)
    return request if grid_size is None else request.with_grid(grid_size)
