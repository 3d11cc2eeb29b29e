"""`volprep.show`: a volume in a notebook, in one line."""

import io
from dataclasses import replace
from os import PathLike
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Unpack

from volprep.library.choices import SourceChoices
from volprep.library.notebook.sources import Volume, package_path, scan_file
from volprep.library.notebook.widget import VolumeWidget
from volprep.library.packages import request_for, source_file
from volprep.pipeline.build import build
from volprep.report.text import number, size
from volprep.scene.request import Request
from volprep.validation.folder import DATA_FILE, default_report_path
from volprep.validation.results.report import Report
from volprep.view.site import shown_with
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.reader import Package
from volprep_formats.package.storage.files import MANIFEST
from volprep_formats.package.storage.single_file import write_single_file
from volprep_formats.progress import Progress, Silent
from volprep_formats.shown import shown


def words_of(package: Package) -> str:
    """Return the contents of a package and the verdict of the report beside it.

    Raises the errors of `shown_with`.
    """
    manifest = package.manifest
    grid = manifest.box
    voxels = " × ".join(str(count) for count in grid.shape_zyx[::-1])
    spacing = " × ".join(number(length) for length in grid.spacing_mm_zyx[::-1])
    levels = f"{len(manifest.levels)} level{'s' if len(manifest.levels) > 1 else ''}"
    held = size(sum(file.size_bytes for file in manifest.files))
    profile = shown(manifest.profile.name)
    return f"{voxels} voxels of {spacing} mm, {levels}, {held}, profile {profile}. {_verdict(package)}"


def _verdict(package: Package) -> str:
    report = shown_with(package.path, None, default_report_path(package.path)).report
    if report is None:
        return "Not validated."
    data = Report.model_validate_json((report / DATA_FILE).read_bytes())
    verdict, limit = data.verdict, data.tolerance.rmse
    outcome = "passed" if verdict.passed else "failed"
    return f"Validation {outcome}: RMSE {number(verdict.worst_rmse)} in the worst view, {number(limit)} allowed."


MOST_BYTES = 2**28
"""Largest package in a notebook: it is sent to the browser as one message."""


def show(
    scene: Volume,
    *,
    preset: str | None = None,
    profile: str | None = None,
    spacing_mm_zyx: tuple[float, float, float] | None = None,
    editable: bool = False,
    view: str = "",
    clip: tuple[float, ...] | None = None,
    background: str = "#000000",
    keep: bool = False,
    progress: Progress | None = None,
    **choices: Unpack[SourceChoices],
) -> VolumeWidget:
    """Show a volume in JupyterLab, VS Code, Colab or marimo.

    Parameters
    ----------
    scene
        Array [z, y, x]; path of a scan, scene or package; a package from `open_package`; `pyvista.ImageData` with
        active scalars; or `SimpleITK.Image`. A package is shown as it is, anything else is built in a temporary folder.
    preset
        Transfer function that comes with volprep; if absent, one that suits the values.
    profile
        Class of devices; if absent, the scene's.
    spacing_mm_zyx
        Distance of the voxels of an array, in millimetres; 1 if absent.
    editable
        Whether the widget's `points` may change the transfer function.
    view
        Standard view to begin with; if absent, "anterior-left".
    clip
        Part of the box to draw, its low and its high corner (x, y, z) from 0 to 1.
    background
        Background colour, "#rrggbb".
    keep
        Whether the saved state of the notebook holds the package, so that the volume is drawn without Python. Whoever
        gets the notebook then has the scan.
    progress
        Progress callback, or None.
    choices
        Part of the source to read, with the keys of [source] in a scene.

    Returns
    -------
    VolumeWidget
        The widget. Its traits `view`, `camera`, `function`, `clip` and `points` follow the picture and change it.

    Raises
    ------
    VolprepError
        VP7090 without the extra `notebook`, VP7091 for a package that is too large, VP7092 for an object of another
        type, and the errors of `build_package` and `open_package`.
    """
    traits = {"view": view, "clip": None if clip is None else list(clip), "background": background, "keep": keep}
    path = package_path(scene)
    if path is not None and not any((preset, profile, spacing_mm_zyx, editable, choices)):
        return widget_of(path, **traits)
    with TemporaryDirectory(prefix="volprep-") as name:
        folder = Path(name)
        scan = scan_file(scene if path is None else path, folder)
        file = source_file(scan, folder / "volume.npy", spacing_mm_zyx, choices)
        request = request_for(file, profile, preset, None, choices)
        if editable:
            request = replace(request, scene=request.scene.model_copy(update={"editable": True}))
        return built_widget(request, folder, progress, **traits)


def built_widget(request: Request, folder: Path, progress: Progress | None, **traits: Any) -> VolumeWidget:
    """Build the package of a request in `folder`, and return a widget that holds it."""
    path = folder / "scan.volpkg"
    build(request, path, progress or Silent())
    return widget_of(path, **traits)


def widget_of(path: str | PathLike[str], **traits: Any) -> VolumeWidget:
    """Return a widget that holds the package at `path`. Raises VP7091 for one that is too large."""
    package = Package.open(Path(path))
    manifest = package.manifest
    functions = {
        function.name: [point.model_dump(mode="json") for point in function.points]
        for function in manifest.transfer_functions
    }
    picture = package.read_bytes(manifest.preview) if manifest.preview else b""
    return VolumeWidget(functions, package=_single_file(package), picture=picture, label=words_of(package), **traits)


def _single_file(package: Package) -> bytes:
    path = package.path
    size = sum(file.size_bytes for file in package.manifest.files)
    if size > MOST_BYTES:
        raise VolprepError("VP7091", path=path, size=size, limit=MOST_BYTES)
    if path.is_file():
        return path.read_bytes()
    file = io.BytesIO()
    write_single_file(path, [MANIFEST, *(record.path for record in package.manifest.files)], file, Silent())
    return file.getvalue()
