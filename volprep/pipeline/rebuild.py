"""Whether a build may replace the package that is at its target."""

from pathlib import Path

from volprep.pipeline.origin import read_origin
from volprep.scene.request import Request
from volprep_formats.diagnostics import VolprepError
from volprep_formats.output import output_errors
from volprep_formats.package.storage.files import MANIFEST
from volprep_formats.path_text import path_text


def check_replaced(request: Request, target: Path, *, force: bool) -> bool:
    """Return whether there is a package at `target` that the build will replace.

    A package that was built of the same scene file, or of the same scan without one, may be replaced. Raises VP1303 for
    another one, unless `force` is given, and VP4020 if the folder of `target` may not be entered.
    """
    with output_errors(target):
        there = (target / MANIFEST).exists()
    if not there:
        return False
    try:
        origin = read_origin(target.absolute())
    except VolprepError:
        origin = None
    if origin is not None:
        here = None if request.scene_path is None else path_text(request.scene_path)
        same_scan = origin.scene.source.path == request.scene.source.path
        if origin.scene_path == here and (here is not None or same_scan):
            return True
    if not force:
        raise VolprepError("VP1303", path=target)
    return True
