"""Data files that a header names: they lie in the folder of the header, or below it."""

from pathlib import Path

from volprep_formats.diagnostics import VolprepError


def data_file(header: Path, name: str) -> Path:
    """File `name` in the folder of `header`, also where links lead to another place.

    Raises VolprepError VP1006 when it leaves the folder, is missing or is no file: a header from elsewhere must not be
    able to read what lies elsewhere.
    """
    problem = ""
    folder = header.parent.resolve()
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
