"""The version of volprep, how it was installed, which of its extras are there, and how to add one."""

import json
from dataclasses import dataclass
from functools import cache
from importlib.metadata import PackageNotFoundError, distribution, version
from importlib.util import find_spec
from typing import Literal
from urllib.parse import unquote, urlsplit

from volprep_formats.diagnostics import VolprepError

Extra = Literal["validate", "batch", "zarr", "convex", "seg", "surface", "registration", "film"]
"""An extra that commands ask for before they start."""


@dataclass(frozen=True)
class ExtraUse:
    """Use of an extra."""

    purpose: str
    """Subject of the message where it is missing."""
    modules: tuple[str, ...]
    """Python modules that it brings. A test compares them with pyproject.toml."""


EXTRAS: dict[Extra, ExtraUse] = {
    "validate": ExtraUse("comparing pictures and writing reports", ("scipy", "flip_evaluator", "jinja2")),
    "batch": ExtraUse("volprep batch", ("dask", "distributed", "fsspec", "psutil", "jinja2")),
    "zarr": ExtraUse("OME-Zarr", ("zarr",)),
    "seg": ExtraUse("DICOM segmentations", ("highdicom",)),
    "surface": ExtraUse("surfaces", ("skimage", "fast_simplification", "pxr")),
    "film": ExtraUse("films", ("av",)),
    "registration": ExtraUse("registrations by ITK and its programs", ("SimpleITK",)),
    "convex": ExtraUse('form = "convex" of a proxy', ("scipy",)),
}


@cache
def generator() -> str:
    """Return program and version, as manifests and reports name them."""
    return f"volprep {version('volprep')}"


def missing_module(extra: Extra) -> str | None:
    """Return the first module of an extra that is not installed; None if all are. Imports none of them."""
    return next((name for name in EXTRAS[extra].modules if find_spec(name) is None), None)


def require_extra(extra: Extra) -> None:
    """Raise VP7005 if a module of an extra is not installed."""
    module = missing_module(extra)
    if module is not None:
        purpose = EXTRAS[extra].purpose
        raise VolprepError("VP7005", purpose=purpose, module=module, extra=extra, how=how_to_add(extra))


def how_to_add(extra: str) -> str:
    """Return the command that installs volprep with an extra from where this installation came."""
    try:
        installed = distribution("volprep")
        told = json.loads(installed.read_text("direct_url.json") or "{}")
    except (PackageNotFoundError, ValueError):
        return f"install volprep again with its extra {extra}"
    url = str(told.get("url", ""))
    if url.startswith("file:") and "dir_info" in told:
        editable = "--editable " if told["dir_info"].get("editable") else ""
        return f"pip install {editable}'{unquote(urlsplit(url).path)}[{extra}]' (a checkout)"
    if url:
        return f"pip install 'volprep[{extra}] @ {url}' (where this installation came from)"
    return f"pip install 'volprep[{extra}]=={installed.version}' from where this installation came"
