"""The folder of a report: it appears under its name whole or not at all, also over an older report."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from volprep_formats.arrays import UInt8Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.output import output_errors, sync_all
from volprep_formats.png import png_bytes
from volprep_formats.record import Record

DATA_FILE = "report.json"
"""Name of the data in the folder of a report."""
PAGE_FILE = "index.html"
"""Name of the page in the folder of a report."""
PICTURES = "pictures"
"""Name of the folder of pictures in the folder of a report."""
_FAILED = "VP6021"


class ReportFolder:
    """A report under construction, beside the place where it will appear."""

    def __init__(self, partial: Path) -> None:
        """Use `report_folder`."""
        self._partial = partial

    def picture(self, name: str, picture: UInt8Array) -> None:
        """Write `picture` [H, W, 3] as the PNG file `name`, which begins with the folder of pictures."""
        path = self._partial / name
        with output_errors(path, _FAILED):
            path.write_bytes(png_bytes(picture))

    def write(self, data: Record, page: str) -> None:
        """Write the data and the page."""
        with output_errors(self._partial, _FAILED):
            (self._partial / DATA_FILE).write_text(data.model_dump_json(indent=2) + "\n", encoding="utf-8")
            (self._partial / PAGE_FILE).write_text(page, encoding="utf-8")


@contextmanager
def report_folder(target: Path) -> Iterator[ReportFolder]:
    """Return a folder to fill. It becomes `target` when the block ends well, and vanishes when it does not.

    Raises VP6020 if something other than a report is at `target`, VP6021 if the system refuses.
    """
    target = target.resolve()
    _require_replaceable(target)
    partial = target.with_name(f".{target.name}.partial")
    older = target.with_name(f".{target.name}.older")
    with output_errors(target, _FAILED):
        for left_behind in (partial, older):
            if left_behind.exists():
                shutil.rmtree(left_behind)
        (partial / PICTURES).mkdir(parents=True)
    try:
        yield ReportFolder(partial)
        with output_errors(target, _FAILED):
            sync_all([*partial.rglob("*"), partial])
            if target.exists():
                target.rename(older)
            partial.rename(target)
            if older.exists():
                shutil.rmtree(older)
    finally:
        shutil.rmtree(partial, ignore_errors=True)


def _require_replaceable(target: Path) -> None:
    """Refuse to remove what is no report: somebody may have named a folder of their own."""
    if target.exists() and not target.is_dir():
        raise VolprepError("VP6020", path=target, problem="it is no folder")
    names = {path.name for path in target.iterdir()} if target.is_dir() else set()
    others = sorted(names - {DATA_FILE, PAGE_FILE, PICTURES})
    if others:
        raise VolprepError("VP6020", path=target, problem=f"it holds {others[0]}, which is no part of a report")
