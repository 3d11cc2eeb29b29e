"""A draft that stages are run on one by one: the import of a source, and the origin beside it."""

from contextlib import suppress
from pathlib import Path

from volprep.pipeline.import_draft import import_draft
from volprep.pipeline.origin import Origin, write_origin
from volprep.pipeline.prepare import prepare
from volprep.scene.request import Request
from volprep_formats.diagnostics import VolprepError
from volprep_formats.output import output_errors
from volprep_formats.package.storage.draft import Draft, require_room
from volprep_formats.package.storage.files import MANIFEST
from volprep_formats.package.storage.publish import remove_package
from volprep_formats.path_text import path_text
from volprep_formats.progress import Progress


def begin_draft(request: Request, folder: Path, progress: Progress) -> Draft:
    """Import a source into the draft at `folder`: a new one, which vanishes if that fails, or one that is there.

    Raises the errors of `import_draft`, before anything is read where `folder` is in the way.
    """
    with output_errors(folder):
        is_new = not (folder / MANIFEST).exists()
    if is_new:
        require_room(folder)
    try:
        imported = import_draft(prepare(request), folder, progress)
    except VolprepError:
        if is_new and (folder / MANIFEST).exists():
            with suppress(VolprepError):  # the first error is the one to report
                remove_package(folder)
        raise
    scene_path = None if request.scene_path is None else path_text(request.scene_path)
    write_origin(folder, Origin(scene_path=scene_path, scene=imported.scene, profile=request.profile))
    return imported.draft
