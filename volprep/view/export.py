"""The page without a server of ours: a folder for any server, or one file that opens by double-click."""

import base64
import shutil
import tempfile
from pathlib import Path

from volprep.view.bundle import bundle
from volprep.view.site import (
    INDEX,
    PAGE,
    RUNTIME,
    SETTINGS,
    ZIP,
    ServedFile,
    ShownPackage,
    Site,
    ViewSettings,
    make_site,
    page_modules,
    read_served,
)
from volprep_formats.content_policy import source_digest
from volprep_formats.diagnostics import VolprepError
from volprep_formats.javascript import stripped
from volprep_formats.output import new_file, new_folder, output_errors, taken
from volprep_formats.package.storage.files import MANIFEST
from volprep_formats.package.storage.single_file import write_single_file
from volprep_formats.progress import Progress
from volprep_formats.runtime import runtime_modules

MOST_PAGE_BYTES = 2**28
"""Largest package in one file: browsers hold its text, a third longer, as one piece."""
_PART_BYTES = 3 * 2**20
"""Bytes of a block of text in the file: a multiple of 3, so that blocks of base64 can be decoded one by one."""
_STYLE = f'<link rel="stylesheet" href="{PAGE}/style.css">'
_SCRIPT = f'<script type="module" src="{PAGE}/main.js"></script>'
_POLICY_PLACE = '<meta charset="utf-8">'
_FOLDER_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'"
)
_OWN_NAMES = frozenset((INDEX, SETTINGS, ZIP, "package", "report", "runtime", PAGE))
"""Names in the folder of a page, whatever package it shows."""


def write_page_folder(shown: ShownPackage, target: Path, progress: Progress, *, force: bool = False) -> int:
    """Write the page as static files, and return their number.

    Raises VP7033 if `target` must not be replaced, VP4020 if it cannot be written, and the errors of `make_site`.
    """
    site = make_site(shown, takes_devices=False)
    _require_replaceable(target, force=force)
    progress.start("write the page", len(site))
    with new_folder(target, replaces=force) as folder:
        for address, served in site.items():
            _copy(served, folder / address)
            progress.advance()
        page = read_served(site[INDEX]).decode()
        (folder / INDEX).write_text(_with_policy(page, _FOLDER_POLICY), encoding="utf-8")
    return len(site)


def write_page_file(shown: ShownPackage, target: Path, progress: Progress, *, force: bool = False) -> int:
    """Write the page and the package as one file of HTML, and return its size.

    Raises VP1251 if a file is at `target` and not `force`, VP1254 if a folder is, VP7034 for a package that is too
    large, and as `write_page_folder` does.
    """
    with output_errors(target):
        if target.is_dir() or (target.exists() and not force):
            raise taken(target)
    path = shown.package.path
    size = sum(record.size_bytes for record in shown.package.manifest.files)
    if size > MOST_PAGE_BYTES:
        raise VolprepError("VP7034", path=path, size=size, limit=MOST_PAGE_BYTES)
    site = make_site(shown, takes_devices=False)
    head, tail = _page_around(site)
    # Beside the page: an error of its disk is one of the page's.
    beside = target.absolute().parent
    with new_file(target) as file, tempfile.TemporaryFile(dir=beside) as packed:
        if path.is_file():
            packed.write(read_served(site[ZIP]))
        else:
            names = [MANIFEST, *(record.path for record in shown.package.manifest.files)]
            write_single_file(path, names, packed, progress)
        file.write(head.encode())
        packed.seek(0)
        while data := packed.read(_PART_BYTES):
            file.write(_block(ZIP, data))
        for address in site:
            if address.startswith("report/"):
                file.write(_block(address, read_served(site[address])))
        file.write(tail.encode())
    return target.stat().st_size


def _page_around(site: Site) -> tuple[str, str]:
    """Return the text of the page before and behind the data that it holds."""
    page = read_served(site[INDEX]).decode()
    style = read_served(site[f"{PAGE}/style.css"]).decode()
    modules = {f"{PAGE}/{name}": text for name, text in page_modules().items()}
    modules |= {f"{RUNTIME}/{name}": text for name, text in runtime_modules().items()}
    script = stripped(bundle(modules, f"{PAGE}/main.js")).replace("</script", "<\\/script").replace("<!--", "<\\!--")
    settings = ViewSettings.model_validate_json(read_served(site[SETTINGS])).model_copy(update={"package": ZIP})
    policy = (
        f"default-src 'none'; script-src '{source_digest(script)}'; style-src '{source_digest(style)}'; "
        "img-src blob: data:; base-uri 'none'; form-action 'none'"
    )
    page = _with_policy(_once(page, _STYLE, f"<style>{style}</style>"), policy)
    before, behind = _once(page, _SCRIPT, "\0").split("\0")
    # Names of transfer functions are foreign text, and a tag in them would end the script.
    told = settings.model_dump_json().replace("<", "\\u003c")
    told = f'<script type="application/json" id="{SETTINGS}">{told}</script>\n'
    # The module runs when the document has been read, with all of the data behind it.
    return before + told, f'<script type="module">{script}</script>{behind}'


def _block(address: str, data: bytes) -> bytes:
    # A type that is no script: browsers keep the text and run nothing.
    text = base64.b64encode(data)
    return f'<script type="text/plain" data-file="{address}">'.encode() + text + b"</script>\n"


def _with_policy(page: str, policy: str) -> str:
    meta = f'<meta http-equiv="Content-Security-Policy" content="{policy}">'
    return _once(page, _POLICY_PLACE, f"{_POLICY_PLACE}\n{meta}")


def _once(text: str, what: str, instead: str) -> str:
    if text.count(what) != 1:
        raise VolprepError("VP7035", path=INDEX)
    return text.replace(what, instead)


def _copy(served: ServedFile, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with served.open() as contents, path.open("wb") as file:
        contents.file.seek(contents.start_bytes)
        shutil.copyfileobj(contents.file, file)


def _require_replaceable(target: Path, *, force: bool) -> None:
    """Refuse a folder that is not empty, unless it is an older page that may be replaced."""
    with output_errors(target):
        names = _names(target)
    if names is None:
        raise VolprepError("VP7033", path=target, problem="it is a file")
    if names and not {INDEX, SETTINGS} <= names:
        raise VolprepError("VP7033", path=target, problem=f"it is not an older page: it has no {SETTINGS}")
    if others := sorted((names or set()) - _OWN_NAMES):
        raise VolprepError("VP7033", path=target, problem=f"it holds {others[0]}, which is no part of a page")
    if names and not force:
        raise VolprepError("VP7033", path=target, problem="it is an older page")


def _names(target: Path) -> set[str] | None:
    """Return the names in a folder, none if it does not exist; None if it is not a folder."""
    if not target.exists():
        return set()
    return {path.name for path in target.iterdir()} if target.is_dir() else None
