"""Data files named by a header: they must be in the folder of the header, or below it."""

from pathlib import Path, PureWindowsPath

from volprep_formats.diagnostics import VolprepError
from volprep_formats.regular_files import is_there


def data_file(header: Path, name: str) -> Path:
    """Return the file `name` in the folder of `header`, with links resolved.

    Raises VolprepError VP1006 when it leaves the folder, is missing or is not a file: an untrusted header must not be
    able to read files elsewhere. Of a path with a drive or backslashes, as programs on Windows write it, the last part
    is taken if there is no file of the whole name.
    """
    problem = ""
    folder = header.parent.resolve()
    of_windows = PureWindowsPath(name)
    if (of_windows.drive or "\\" in name) and not is_there(header.parent / name):
        name = of_windows.name
    try:
        path = (folder / name).resolve()
        if not path.is_relative_to(folder):
            problem = "lies outside the folder of the header"
        elif not path.is_file():
            problem = "is no regular file" if path.exists() else "is missing"
    except (OSError, ValueError, RuntimeError):  # too long, a zero byte, links in a circle
        problem = "is not the name of a file"
    if problem:
        raise VolprepError("VP1006", path=header, name=name[:100], problem=problem)
    return path
