"""Packages: planned, built, opened, checked and validated."""

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from os import PathLike
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal, Unpack

import numpy as np
from numpy.typing import NDArray

from volprep.library.choices import SourceChoices, source_of
from volprep.pipeline.build import build, plan_build
from volprep.plan.records import Plan
from volprep.scene.request import Request, request_of
from volprep.validation.folder import default_report_path
from volprep.validation.results.report import Report
from volprep_formats.diagnostics import VolprepError
from volprep_formats.installation import require_extra
from volprep_formats.output import new_file, output_errors
from volprep_formats.package.check import Finding, check
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.reader import Package
from volprep_formats.progress import Progress, Silent


def plan_package(
    scene: str | PathLike[str] | NDArray[np.generic],
    *,
    spacing_mm_zyx: tuple[float, float, float] | None = None,
    profile: str | None = None,
    preset: str | None = None,
    grid_size: Literal["auto"] | int | None = None,
    progress: Progress | None = None,
    **choices: Unpack[SourceChoices],
) -> Plan:
    """Plan the package of a scene or scan: its contents, their reasons and costs. Writes nothing.

    `items` of the plan has one record for each decision: name, reason, size. It takes the arguments of
    `build_package` and raises the same errors.
    """
    with TemporaryDirectory(prefix="volprep-") as folder:
        place = source_file(scene, Path(folder) / "array.npy", spacing_mm_zyx, choices)
        return plan_build(request_for(place, profile, preset, grid_size, choices), progress or Silent())


def build_package(
    scene: str | PathLike[str] | NDArray[np.generic],
    package: str | PathLike[str],
    *,
    spacing_mm_zyx: tuple[float, float, float] | None = None,
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
        Scene file, which ends in .toml, or a scan alone, drawn as its values suggest. Or an array [z, y, x], which is
        written to PACKAGE.source.npy beside the package, where validation finds it again.
    package
        Where the package goes. An older package there stays until the new one is whole.
    spacing_mm_zyx
        Distance of the voxels of an array, in millimetres; 1 if absent.
    profile
        Class of devices, or the path of a profile; if absent, the scene's.
    preset
        Transfer function that comes with volprep, in place of the scene's; `list_presets` names them.
    grid_size
        Size of the sub-volumes in voxels, or "auto" to cut only what the profile cannot hold whole; if absent, as the
        scene says.
    progress
        Progress callback, or None.
    choices
        Part of the source to read, with the keys of [source] in a scene; they replace the scene's.

    Raises
    ------
    VolprepError
        VP9010 for a choice that a source cannot have, VP1282 for an array with masked voxels or without three axes,
        VP1xxx and VP2xxx for the scan, VP30xx for scene, profile and preset, VP402x and VP404x for files that cannot be
        written.
    """
    target = Path(package)
    array = target.with_name(f"{target.name}.source.npy")
    with _as_before_if_failed(array) if isinstance(scene, np.ndarray) else nullcontext():
        place = source_file(scene, array, spacing_mm_zyx, choices)
        request = request_for(place, profile, preset, grid_size, choices)
        return build(request, target, progress or Silent())


@contextmanager
def _as_before_if_failed(file: Path) -> Iterator[None]:
    """Put an older file back, or remove a new one, if the work fails: an older package keeps its source."""
    older = file.with_name(f".{file.name}.older")
    if file.exists():
        file.replace(older)
    try:
        yield
    except BaseException:
        file.unlink(missing_ok=True)
        if older.exists():
            older.replace(file)
        raise
    older.unlink(missing_ok=True)


def validate_package(
    package: str | PathLike[str],
    *,
    source: str | PathLike[str] | None = None,
    report: str | PathLike[str] | None = None,
    size: int | None = None,
    progress: Progress | None = None,
) -> Report:
    """Validate a package against its scan, write the report, and return its data.

    `verdict.passed` of the result says whether the package may ship. `source` is the scan, if PACKAGE.origin.json does
    not name it. `report` is the folder of the report; if absent, NAME.report beside the package. `size` is the width
    and height of the pictures; if absent, as the scene says. Raises the errors of `volprep validate`, except that a
    package beyond its tolerance is no error here.
    """
    require_extra("validate")
    from volprep.report.validate import validate  # noqa: PLC0415 - its libraries are in an extra

    path = Path(package)
    return validate(
        path,
        default_report_path(path) if report is None else Path(report),
        progress or Silent(),
        source=None if source is None else Path(source),
        picture_size=size,
    )


def check_package(package: str | PathLike[str]) -> list[Finding]:
    """Return all faults of a package's files, empty for a whole package. It needs no scan and no OpenGL."""
    return check(Path(package))


def open_package(package: str | PathLike[str]) -> Package:
    """Open a package, a folder or a zip: its manifest, and its files by name. Raises VP40xx for an unsound one."""
    return Package.open(Path(package))


def source_file(
    scene: str | PathLike[str] | NDArray[np.generic],
    file: Path,
    spacing_mm_zyx: tuple[float, float, float] | None,
    choices: SourceChoices,
) -> str | PathLike[str]:
    """Return the path of a scene or scan; an array is written to `file`, and `choices` get its spacing.

    Raises VP9010 for a spacing that belongs to no array, VP1282 for an array with masked voxels.
    """
    if not isinstance(scene, np.ndarray):
        if spacing_mm_zyx is not None:
            raise VolprepError("VP9010", problems="spacing_mm_zyx is for arrays; a file has its own")
        return scene
    if np.ma.is_masked(scene):
        raise VolprepError("VP1282", path=file, what="masked voxels, whose mask a file does not keep (array.filled)")
    choices["array"] = {"spacing_mm_zyx": spacing_mm_zyx or (1.0, 1.0, 1.0)}
    with output_errors(file):
        file.parent.mkdir(parents=True, exist_ok=True)
        with new_file(file) as opened:
            np.save(opened, np.ascontiguousarray(scene))
    return file


def request_for(
    scene: str | PathLike[str],
    profile: str | None,
    preset: str | None,
    grid_size: Literal["auto"] | int | None,
    choices: SourceChoices,
) -> Request:
    """Return the request of a scene or scan with what the caller chose in place of the scene's settings."""
    request = request_of(Path(scene), profile)
    if choices:
        # Paths in the choices are relative to the current folder, paths in the scene to the scene's.
        meant = source_of(Path(), choices)
        request = request.with_source(**{key: getattr(meant, key) for key in choices})
    if preset is not None:
        request = request.with_preset(preset)
    return request if grid_size is None else request.with_grid(grid_size)
