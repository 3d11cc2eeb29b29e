"""Publishing: a package is renamed into place only when it is complete, also over an older one."""

import os
from pathlib import Path, PurePosixPath

from volprep_formats.diagnostics import VolprepError
from volprep_formats.output import exchange, output_errors, rename_new, sync_all, sync_folder
from volprep_formats.package.manifest_json import read_manifest
from volprep_formats.package.storage.draft import recover
from volprep_formats.package.storage.files import MANIFEST, MANIFEST_IN_MAKING, names_in, path_inside, remove_empty


def publish(partial: Path, target: Path) -> None:
    """Move the sealed package at `partial` to `target`, in one step, and remove the older package from there.

    Both must lie on one file system. On Linux the two folders are exchanged (renameat2), so that at every moment
    `target` is the older or the newer package. If the system or the file system cannot exchange, the older package is
    first renamed to `partial` with ".old" appended: a process killed at that moment leaves no package under the name,
    and the next `publish` cleans up. A process killed after the exchange leaves the older package at `partial`: a
    sealed package found there must be removed (`remove_package`), not published.

    Raises VP4001 to VP4005 if `partial` is not a sealed package, VP4021 or VP4022 if `target` is something else, and
    VP4020 if the system refuses.
    """
    recover(partial)
    manifest = read_manifest(partial)
    if manifest.state != "sealed":
        raise VolprepError("VP4005", path=partial)
    check_target(target)
    aside = partial.with_name(partial.name + ".old")
    if os.path.lexists(aside) and os.path.lexists(target):
        remove_package(aside)
    with output_errors(target):
        # A draft need not be lasting, but a published package must be.
        files = [path_inside(partial, name) for name in (*(record.path for record in manifest.files), MANIFEST)]
        folders = {folder for file in files for folder in file.parents if folder.is_relative_to(partial)}
        sync_all([*files, *folders])
        if os.path.lexists(target):
            exchange(partial, target, aside)
        else:
            rename_new(partial, target)
        sync_folder(target.parent)
    for older in (partial, aside):
        if os.path.lexists(older):
            remove_package(older)


def check_target(target: Path) -> None:
    """Raise VP4021 or VP4022 if `publish` would refuse `target`: not a package, or with other files in it."""
    if os.path.lexists(target):
        _own_names(target)


def remove_package(folder: Path) -> None:
    """Remove a package or a draft: the files that its manifest names, and the folder. An empty folder goes, too.

    Raises VP4021 if it is not a package, VP4022 if other files are in it, VP4012 while another process works on it,
    VP4020 if the system refuses. The manifest goes last, so that what a killed removal leaves can be removed again.
    """
    names = _own_names(folder)
    with output_errors(folder):
        for name in names:
            path_inside(folder, name).unlink(missing_ok=True)
            remove_empty(path_inside(folder, name).parent, folder)
        folder.rmdir()


def _own_names(folder: Path) -> list[str]:
    """List the files of a package, its manifest last, after making sure that it is one and holds nothing else."""
    if folder.is_symlink():
        raise VolprepError("VP4021", path=folder, problem="it is a symbolic link")
    if folder.is_dir():
        # Do not look deeper: a folder that is not a package may be a whole disk.
        with output_errors(folder):
            names = [entry.name for entry in folder.iterdir()]
        if set(names) <= {MANIFEST_IN_MAKING}:  # left by a killed create or removal
            return names
    try:
        read_manifest(folder)
    except VolprepError as error:
        raise VolprepError("VP4021", path=folder, problem=error.summary.removeprefix(f"{folder}: ")) from error
    recover(folder)
    named = [*(record.path for record in read_manifest(folder).files), MANIFEST]
    # An empty folder, whose files are missing, still belongs to the package.
    own = {*named, *(f"{parent}/" for name in named for parent in PurePosixPath(name).parents)}
    others = [name for name in names_in(folder) if name not in own]
    if others:
        raise VolprepError("VP4022", path=folder, count=len(others), first=others[0])
    return named
