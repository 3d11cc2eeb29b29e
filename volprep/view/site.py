"""Everything that a browser can request: every file of the page by its address, and nothing else.

Paths are never built from an address: an address is looked up here, so that none can lead elsewhere.
"""

import io
import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from pydantic import ValidationError

from volprep.validation.folder import DATA_FILE, TRUTH, is_report_of
from volprep.validation.results.truth import TRUTH_FILE, TruthIndex
from volprep_formats.diagnostics import VolprepError
from volprep_formats.installation import generator
from volprep_formats.javascript import stripped
from volprep_formats.package.digest import manifest_sha256
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.reader import Package
from volprep_formats.package.storage.contents import Contents, open_contents
from volprep_formats.package.storage.files import MANIFEST
from volprep_formats.record import Record
from volprep_formats.regular_files import open_regular, read_regular
from volprep_formats.runtime import runtime_folder, sent_modules
from volprep_formats.textures.texel_formats import PALETTED

INDEX = "index.html"
SETTINGS = "view.json"
ZIP = "package.volpkg.zip"
"""Address of a package that is one file."""
DEVICES = "devices"
"""Address that measurements are sent to."""
PAGE = "page"
RUNTIME = "runtime"
_FOLDER = "package/"
_REPORT = "report"
_PAGE_FOLDER = Path(__file__).parent / PAGE
_TYPES = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".json": "application/json",
    ".png": "image/png",
}


class ViewSettings(Record):
    """Data of the page beside the manifest; addresses are relative to the page."""

    generator: str
    """Program and version that made the page."""
    package: str
    """Address of the package: a folder, which ends in a slash, or one file."""
    manifest_sha256: str
    """Digest of its manifest; measurements name the package by it."""
    report: str | None
    """Address of the data of the report; null without one."""
    truth: str | None
    """Address of the folder of truth pictures; null without one."""
    devices: str | None
    """Where to send measurements; null if the server takes none."""
    opaque_lengths_mm: Mapping[str, float]
    """By transfer function: the length whose opacity pixels have, for functions of pictures of one value of a ray."""


@dataclass(frozen=True)
class ServedFile:
    """A file that a browser can ask for."""

    content_type: str
    """Its media type."""
    open: Callable[[], Contents]
    """Gives it, open."""


Site = Mapping[str, ServedFile]
"""Each file by its address, relative to the page."""


@dataclass(frozen=True)
class ShownPackage:
    """A package, and the report that is shown with it."""

    package: Package
    """The package, sealed."""
    report: Path | None
    """Folder of its report; None without one."""
    truth: TruthIndex | None
    """Truth pictures in that folder."""


def shown_with(path: Path, report: Path | None, usual_report: Path) -> ShownPackage:
    """Open the package at `path`, and find its report: the folder `report`, or else `usual_report` if it is there.

    Raises the errors of opening a package, VP7030 for slices without palettes, VP7039 for a `report` of another
    package. A usual report of another package is not shown.
    """
    package = Package.open(path)
    if any(texture.format != PALETTED for texture in package.manifest.textures_of("slices")):
        raise VolprepError("VP7030", path=path, profile=package.manifest.profile.name)
    folder = report or usual_report
    if not is_report_of(folder, path):
        if report is not None:
            raise VolprepError("VP7039", path=report)
        return ShownPackage(package, None, None)
    return ShownPackage(package, folder, _truth(folder, path))


def make_site(shown: ShownPackage, *, takes_devices: bool) -> Site:
    """Return all files of the page for a package. Raises VP7035 if the installation lacks some."""
    path = shown.package.path
    site = dict(_files_of_page())
    if path.is_file():
        site[ZIP] = file_served(path)
    else:
        names = [MANIFEST, *(record.path for record in shown.package.manifest.files)]
        site |= {f"{_FOLDER}{name}": _part(path, name) for name in names}
    if shown.report is not None:
        site[f"{_REPORT}/{DATA_FILE}"] = file_served(shown.report / DATA_FILE)
    if shown.report is not None and shown.truth is not None:
        names = [TRUTH_FILE, *(view.file for program in shown.truth.programs for view in program.views)]
        site |= {f"{_REPORT}/{TRUTH}/{name}": file_served(shown.report / TRUTH / name) for name in names}
    settings = ViewSettings(
        generator=generator(),
        package=ZIP if path.is_file() else _FOLDER,
        manifest_sha256=manifest_sha256(path),
        report=None if shown.report is None else f"{_REPORT}/{DATA_FILE}",
        truth=None if shown.truth is None else f"{_REPORT}/{TRUTH}/",
        devices=DEVICES if takes_devices else None,
        opaque_lengths_mm=_opaque_lengths_mm(shown.package.manifest),
    )
    site[SETTINGS] = text_served(settings.model_dump_json(indent=2) + "\n", SETTINGS)
    return site


def _opaque_lengths_mm(manifest: Manifest) -> dict[str, float]:
    lengths = {function.name: manifest.opaque_length_mm(function) for function in manifest.transfer_functions}
    return {name: length for name, length in lengths.items() if length is not None}


def read_served(served: ServedFile) -> bytes:
    """Return all bytes of a file."""
    with served.open() as contents:
        return contents.read()


def page_style() -> str:
    """Return the style sheet of the page."""
    return (_PAGE_FOLDER / "style.css").read_text(encoding="utf-8")


def page_modules() -> dict[str, str]:
    """Return the text of each module of the page, as it was written."""
    return {path.name: path.read_text(encoding="utf-8") for path in sorted(_PAGE_FOLDER.glob("*.js"))}


def _files_of_page() -> Iterator[tuple[str, ServedFile]]:
    index = _PAGE_FOLDER / INDEX
    runtime = sent_modules()
    for needed, found in ((index, index.is_file()), (runtime_folder(), bool(runtime))):
        if not found:
            raise VolprepError("VP7035", path=needed)
    yield INDEX, file_served(index)
    for path in sorted(_PAGE_FOLDER.glob("*.css")):
        yield f"{PAGE}/{path.name}", file_served(path)
    for name, text in page_modules().items():
        yield f"{PAGE}/{name}", text_served(stripped(text), name)
    for name, text in runtime.items():
        yield f"{RUNTIME}/{name}", text_served(text, name)


def _truth(report: Path, package: Path) -> TruthIndex | None:
    try:
        data = read_regular(report / TRUTH / TRUTH_FILE)
        index = TruthIndex.model_validate_json(data)
    except (OSError, ValidationError):
        return None
    return index if index.manifest_sha256 == manifest_sha256(package) else None


def _content_type(name: str) -> str:
    return _TYPES.get(Path(name).suffix, "application/octet-stream")


def file_served(path: Path) -> ServedFile:
    """Return a file of the disk."""

    def opened() -> Contents:
        file = open_regular(path)
        return Contents(path.name, file, 0, os.fstat(file.fileno()).st_size)

    return ServedFile(_content_type(path.name), opened)


def _part(package: Path, name: str) -> ServedFile:
    return ServedFile(_content_type(name), lambda: open_contents(package, name))


def text_served(text: str, name: str) -> ServedFile:
    """Return a file that is only a text."""
    data = text.encode()

    def opened() -> Contents:
        return Contents(name, io.BufferedReader(io.BytesIO(data)), 0, len(data))

    return ServedFile(_content_type(name), opened)
