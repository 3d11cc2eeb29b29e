"""The scans: test data of the libraries that the tests install, of some wheels, and the shared real scans."""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from .wheels import Wheel, unpacked

_DICOM = ("*.dcm", "zipMR.gz", "dicomdirtests/DICOMDIR", "dicomdirtests/*/*")
_NIBABEL = ("*.nii", "*.nii.gz", "*.hdr", "*.mgz", "*.mnc", "*.v", "*+*.HEAD", "phantom_*.PAR", "*.trk", "[01].dcm")
_WHEELS = (
    (Wheel("nilearn==0.14.1", "nilearn/datasets/data/"), ("mni*.nii.gz", "image*.nii.gz", "*.mgz")),
    (Wheel("dipy==1.12.1", "dipy/data/files/"), ("*.nii", "*.nii.gz", "C.npy", "circle.npy", "t1_*.npy")),
    (Wheel("pydicom-data==1.0.0", "data_store/data/"), ("*.dcm",)),
)
_SHARED = (
    *("mr_t1_studyforrest/dicoms", "ct_phantom_tilt-18.5/S2010", "decubitus_hfp_sag/2_t1_fl2d_sag"),
    *("dicom_transfer_syntaxes/In/*", "dicom_compressed_series/*/", "nifti_ch2/ch2.nii.gz", "flair_pair/FLAIR.n*"),
    *("orient48/nifti_space/*.nii.gz", "qim_microct/*.tif", "engine_pair/png_stack", "vdb/*.vdb"),
    *("segments/*.mgz", "segments/dcmqi/data/segmentations/*/", "segments/rt-utils/tests/*/"),
)
_ORIENTATIONS = 6
"""Of the 48 orientations of one volume, as many are taken."""


@dataclass(frozen=True)
class Input:
    """A file or a folder that a new user names."""

    origin: str
    """Who published it."""
    name: str
    path: Path


def inputs() -> list[Input]:
    """Return all that can be reached here."""
    return [*_installed(), *_in_wheels(), *_shared()]


def _installed() -> Iterator[Input]:
    for package, inner, patterns in (
        ("pydicom", "data/test_files", _DICOM),
        ("nibabel", "tests/data", _NIBABEL),
        ("nibabel", "nicom/tests/data", ("*.dcm", "*.dcm.gz")),
        ("pyvista", "examples", ("*.vti", "*.vtk", "*.ply")),
        ("skimage", "data", ("multipage*.tif", "phantom.png", "lfw_subset.npy")),
    ):
        yield from _matching(package, _home(package) / inner, patterns)


def _in_wheels() -> Iterator[Input]:
    for wheel, patterns in _WHEELS:
        folder = unpacked(wheel)
        if folder is None:
            print(f"{wheel.requirement} cannot be downloaded; its scans are left out", flush=True)
        else:
            yield from _matching(wheel.requirement.partition("=")[0], folder, patterns)


def _shared() -> Iterator[Input]:
    folder = os.environ.get("VOLPREP_TEST_DATA")
    if not folder:
        return
    oriented = 0
    for each in _matching("shared", Path(folder), _SHARED):
        oriented += "orient48" in each.name
        if "orient48" not in each.name or oriented <= _ORIENTATIONS:
            yield each


def _matching(origin: str, folder: Path, patterns: tuple[str, ...]) -> Iterator[Input]:
    for pattern in patterns:
        for path in sorted(folder.glob(pattern)):
            if path.is_file() or pattern.endswith("/") or path.suffix == "":
                yield Input(origin, path.relative_to(folder).as_posix(), path)


def _home(package: str) -> Path:
    spec = find_spec(package)
    if spec is None or spec.origin is None:
        raise RuntimeError(f"{package} is not installed: make test installs it")
    return Path(spec.origin).parent
