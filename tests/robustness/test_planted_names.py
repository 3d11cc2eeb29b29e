"""Names that are planted in file names, headers, tables and codes reach no package, report or page.

tests/robustness/test_privacy.py fills every text of a DICOM header, and the headers of three more formats.
"""

from collections.abc import Callable
from pathlib import Path

import nibabel
import numpy as np
import pytest
from command_line import volprep
from segment_files import coded, seg, seg_nrrd, structure_set

from .subjects import SUBJECTS, sound_file

CANARY = "ZQCANARY"
SUFFIXES = (
    *(".npy", ".npz", ".nii.gz", ".nrrd", ".mha", ".mgh", ".mgz", ".mif", ".mrc", ".mnc"),
    *(".vti", ".vtk", ".tif", ".exr"),
)
GRID = np.diag([-1.0, -1.0, 2.0, 1.0])


def scan_of(folder: Path) -> Path:
    """Write a scan with a planted name: a ball."""
    z, y, x = np.indices((10, 14, 16))
    values = np.clip(900 - 130 * np.sqrt((z - 5) ** 2 + (y - 7) ** 2 + (x - 8) ** 2), 0, None).astype(np.int16)
    path = folder / f"{CANARY} scan.nii"
    nibabel.save(nibabel.Nifti1Image(values.T, GRID), path)
    return path


def label_map_of(folder: Path) -> list[str]:
    """A label map with a table beside it, whose names are planted, too."""
    labels = np.zeros((16, 14, 10), np.int16)
    labels[2:7, 2:9, 2:8], labels[9:14, 3:10, 2:8] = 1, 2
    nibabel.save(nibabel.Nifti1Image(labels, GRID), folder / f"{CANARY}.nii")
    (folder / f"{CANARY}.txt").write_text(f"1 {CANARY}_a 255 0 0 255\n2 {CANARY}_b 0 255 0 255\n")
    return [f"{CANARY}.nii"]


def masks_of(folder: Path) -> list[str]:
    """A scan with a folder of masks."""
    scan = scan_of(folder)
    masks = folder / f"{CANARY} masks"
    masks.mkdir()
    for number in (1, 2):
        mask = np.zeros((16, 14, 10), np.uint8)
        mask[4 * number : 4 * number + 3, 4:9, 3:7] = 1
        nibabel.save(nibabel.Nifti1Image(mask, GRID), masks / f"{CANARY}_{number}.nii")
    return [scan.name, "--segments", masks.name]


def codes_of(folder: Path) -> list[str]:
    """A scan with a segmentation whose codes say to be public, and mean a person."""
    scan = scan_of(folder)
    frames = [(number, (0, 0, 6.0 + 2 * number), np.ones((14, 16), np.uint8)) for number in (1, 2)]
    planted = coded("10200004", f"{CANARY} of a known code"), coded(f"{CANARY} code", f"{CANARY} of an unknown code")
    path = seg(folder / f"{CANARY} segments.dcm", frames)
    import pydicom

    data = pydicom.dcmread(path)
    for item, code in zip(data.SegmentSequence, planted, strict=True):
        item.SegmentLabel, item.SegmentedPropertyTypeCodeSequence = f"{CANARY} label", code
    data.SharedFunctionalGroupsSequence[0].PixelMeasuresSequence[0].PixelSpacing = ["1", "1"]
    data.save_as(path)
    return [scan.name, "--segments", path.name]


def contours_of(folder: Path) -> list[str]:
    """A scan with a structure set, whose names are planted."""
    scan = scan_of(folder)
    squares = [[(4, 4, z), (10, 4, z), (10, 10, z), (4, 10, z)] for z in (6, 8, 10)]
    path = structure_set(folder / f"{CANARY} contours.dcm", [squares, squares[:1]])
    import pydicom

    data = pydicom.dcmread(path)
    data.StructureSetLabel = data.StructureSetName = data.PatientName = f"{CANARY}^set"
    for own in data.StructureSetROISequence:
        own.ROIName = own.ROIDescription = f"{CANARY} structure"
    data.save_as(path)
    return [scan.name, "--segments", path.name]


def layers_of(folder: Path) -> list[str]:
    """A scan with a segmentation of 3D Slicer, whose names and tags are planted."""
    values = np.zeros((10, 14, 16), np.int16)
    values[3:7, 4:10, 4:12] = 900
    nibabel.save(nibabel.Nifti1Image(values.T, np.diag([-0.25, -0.5, 2.0, 1.0])), folder / f"{CANARY} scan.nii")
    fields = [f"Segment0_Name:={CANARY}", f"Segment0_ID:={CANARY}_1", "Segment0_LabelValue:=1", "Segment0_Layer:=0"]
    fields += [f"Segment0_Tags:=TerminologyEntry:{CANARY}~SCT^10200004^{CANARY}|", f"Segmentation_Source:={CANARY}"]
    path = seg_nrrd(folder / f"{CANARY}.seg.nrrd", (values > 0).astype(np.uint8)[None], fields)
    path.write_bytes(path.read_bytes().replace(b"space origin: (1,2,3)", b"space origin: (0,0,0)"))
    return [f"{CANARY} scan.nii", "--segments", path.name]


def header_of(folder: Path) -> list[str]:
    """A header with its data file, both named after a person."""
    voxels = np.random.default_rng(2).integers(0, 900, (6, 7, 8)).astype("<i2")
    (folder / f"{CANARY}.raw").write_bytes(voxels.tobytes())
    fields = ("ObjectType = Image", f"Name = {CANARY}", "NDims = 3", "DimSize = 8 7 6", "ElementType = MET_SHORT")
    header = "\n".join([*fields, f"Comment = {CANARY}", f"ElementDataFile = {CANARY}.raw", ""])
    (folder / f"{CANARY}.mhd").write_text(header)
    return [f"{CANARY}.mhd"]


def _of_format(suffix: str) -> Callable[[Path], list[str]]:
    def write(folder: Path) -> list[str]:
        subject = next(each for each in SUBJECTS if each.suffix == suffix)
        (folder / f"{CANARY}{suffix}").write_bytes(sound_file(subject))
        return [f"{CANARY}{suffix}"]

    return write


SOURCES = {
    "label map": label_map_of,
    "masks": masks_of,
    "codes": codes_of,
    "contours": contours_of,
    "layers": layers_of,
    "header": header_of,
    **{suffix: _of_format(suffix) for suffix in SUFFIXES},
}


def planted_in(folder: Path) -> list[str]:
    """Files of a folder with a planted name, in any letters."""
    return [
        str(path.relative_to(folder))
        for path in sorted(folder.rglob("*"))
        if CANARY.lower() in path.name.lower()
        or (path.is_file() and CANARY.lower().encode() in path.read_bytes().lower())
    ]


@pytest.mark.long(keep=3)
@pytest.mark.parametrize("source", SOURCES)
def test_no_planted_name_reaches_a_package_a_report_or_a_page(tmp_path, source) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "out").mkdir()
    words = SOURCES[source](tmp_path / "in")
    done = volprep("build", *words, "-o", "../out/p.volpkg", cwd=tmp_path / "in")
    assert done.returncode == 0, done.stderr
    (tmp_path / "out" / "p.volpkg.origin.json").unlink()  # it stays behind, with the path of the scan
    for command in ("zip p.volpkg", "view p.volpkg -o p.html", "inspect p.volpkg"):
        said = volprep(*command.split(), cwd=tmp_path / "out")
        assert said.returncode == 0, said.stderr
        assert CANARY.lower() not in (said.stdout + said.stderr).lower()
    assert planted_in(tmp_path / "out") == []


@pytest.mark.long
def test_no_planted_name_reaches_what_a_batch_publishes(tmp_path) -> None:
    (tmp_path / "in").mkdir()
    for source in ("label map", ".nrrd"):
        SOURCES[source](tmp_path / "in")
    done = volprep("batch", "in", "-o", "out", "--workers", "1", "--validate", cwd=tmp_path)
    assert done.returncode in {0, 1}, done.stderr
    assert CANARY.lower() not in done.stdout.lower()
    # Origins stay behind, with the paths of scans.
    found = planted_in(tmp_path / "out")
    published = [name for name in found if not name.startswith(".") and not name.endswith(".origin.json")]
    assert published == []
