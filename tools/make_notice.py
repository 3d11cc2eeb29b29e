"""Write NOTICE: what volprep needs where it is installed, each with its licence, by what its own metadata says.

A test compares, and refuses licences that would bind users' products; run this when it fails.

    python tools/make_notice.py
"""

import re
import tomllib
from importlib.metadata import Distribution, distribution
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

_ROOT = Path(__file__).parent.parent
NOTICE = _ROOT / "NOTICE"
_HEAD = """volprep
Licensed under the Apache License, Version 2.0; see LICENSE.

volprep needs these Python packages where it is installed, some of them only for its extras. None of them is part of
it; each has a licence of its own, and so have the libraries that its binary packages bring with them. Written by
tools/make_notice.py.

"""
_EXTRAS = ("validate", "batch", "zarr", "convex", "seg", "surface")
_LONGEST = 60
_NO_ANSWER = "Other/Proprietary License"


def notice() -> str:
    """Return the text of NOTICE for the packages that are installed here."""
    licences = licences_of(user_requirements())
    width = max(len(name) for name in licences)
    return _HEAD + "".join(f"{name.ljust(width)}  {licence}\n" for name, licence in sorted(licences.items()))


def user_requirements() -> list[str]:
    """Requirements of volprep, and of the extras that a wheel's user needs for a whole chain without a witness."""
    project = tomllib.loads((_ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"]
    return [*project["dependencies"], *(line for name in _EXTRAS for line in extras[name])]


def licences_of(requirements: list[str]) -> dict[str, str]:
    """Licence of each package that these requirements bring here, with all that those need."""
    found: dict[str, str] = {}
    waiting = [Requirement(line) for line in requirements]
    while waiting:
        requirement = waiting.pop()
        name = canonicalize_name(requirement.name)
        if name in found or (requirement.marker is not None and not requirement.marker.evaluate({"extra": ""})):
            continue
        installed = distribution(name)
        found[name] = _licence(installed)
        waiting += [Requirement(line) for line in installed.requires or ()]
    return found


def _licence(installed: Distribution) -> str:
    """Licence in the metadata: an expression, a short name, or the classes of the package index."""
    metadata = installed.metadata
    text = metadata.get("License-Expression") or metadata.get("License") or ""
    if text and "\n" not in text and len(text) <= _LONGEST:
        return re.sub(r"\s+", " ", text).strip()
    classes = [line.split(" :: ")[-1] for line in metadata.get_all("Classifier") or () if line.startswith("License ::")]
    return " AND ".join(name for name in classes if name != _NO_ANSWER) or "unknown"


if __name__ == "__main__":
    NOTICE.write_text(notice(), encoding="utf-8")
