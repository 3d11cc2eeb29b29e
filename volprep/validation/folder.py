"""The folder of a report: it appears under its name whole or not at all, also over an older report."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from volprep_formats.arrays import UInt8Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.output import output_errors, sync_all
from volprep_formats.package.digest import manifest_sha256
from volprep_formats.png import png_bytes
from volprep_formats.record import Record
from volprep_formats.regular_files import read_regular

DATA_FILE = "report.json"
"""Name of the data in the folder of a report."""
PAGE_FILE = "index.html"
"""Name of the page in the folder of a report."""
STUDIES = "studies"
"""Name of the folder of studies, a page and its data for each, in the folder of a report."""
PICTURES = "pictures"
"""Name of the folder of pictures in the folder of a report."""
TRUTH = "truth"
"""Name of the folder of truth pictures, for devices to be measured against, in the folder of a report."""
_FAILED = "VP6021"
_MOST_REPORT_BYTES = 2**26


def default_report_path(package: Path) -> Path:
    """Return the place of a package's report: NAME.report beside NAME.volpkg or NAME.volpkg.zip."""
    path = package.resolve()
    return path.with_name(path.name.removesuffix(".zip")).with_suffix(".report")


def is_report_of(report: Path, package: Path) -> bool:
    """Return whether the folder holds a report of the package as it is."""
    import json  # noqa: PLC0415 - only here

    try:
        found = json.loads(read_regular(report / DATA_FILE, _MOST_REPORT_BYTES))
        return bool(found["package"]["manifest_sha256"] == manifest_sha256(package))
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return False


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

    def truth(self, name: str, data: bytes) -> None:
        """Write the file `name` into the folder of truth pictures."""
        path = self._partial / TRUTH / name
        with output_errors(path, _FAILED):
            path.parent.mkdir(exist_ok=True)
            path.write_bytes(data)

    def write(self, data: Record, page: str) -> None:
        """Write the data and the page."""
        self._write(DATA_FILE, data, PAGE_FILE, page)

    def write_study(self, name: str, data: Record, page: str) -> None:
        """Write the data of a study and its page."""
        with output_errors(self._partial / STUDIES, _FAILED):
            (self._partial / STUDIES).mkdir(exist_ok=True)
        self._write(f"{STUDIES}/{name}.json", data, f"{STUDIES}/{name}.html", page)

    def _write(self, data_file: str, data: Record, page_file: str, page: str) -> None:
        with output_errors(self._partial, _FAILED):
            (self._partial / data_file).write_text(data.model_dump_json(indent=2) + "\n", encoding="utf-8")
            (self._partial / page_file).write_text(page, encoding="utf-8")


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
    """Refuse to remove a folder that is not a report: the user may have named one of their own folders."""
    if target.exists() and not target.is_dir():
        raise VolprepError("VP6020", path=target, problem="it is no folder")
    names = {path.name for path in target.iterdir()} if target.is_dir() else set()
    others = sorted(names - {DATA_FILE, PAGE_FILE, STUDIES, PICTURES, TRUTH})
    if others:
        raise VolprepError("VP6020", path=target, problem=f"it holds {others[0]}, which is no part of a report")
