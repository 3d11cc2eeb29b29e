"""Nothing that a DICOM header says of a person comes through: into the package, the report, or what is printed."""

import json
import subprocess
from pathlib import Path

import nibabel
import numpy as np
import pytest
from command_line import volprep
from dicom_files import image, save
from pydicom.datadict import DicomDictionary
from pydicom.dataelem import DataElement
from pydicom.dataset import Dataset
from pydicom.sequence import Sequence
from pydicom.tag import Tag
from pydicom.uid import ImplicitVRLittleEndian

from volprep_formats.readers.dicom.any_file import quiet_pydicom

CANARY = "CANARY^JANE"
TEXT_KINDS = {"AE", "AS", "CS", "DA", "DS", "DT", "IS", "LO", "LT", "PN", "SH", "ST", "TM", "UC", "UI", "UR", "UT"}
NEEDED = {
    "SeriesInstanceUID",
    "PhotometricInterpretation",
    "PixelSpacing",
    "ImageOrientationPatient",
    "ImagePositionPatient",
    "RescaleSlope",
    "RescaleIntercept",
    "NumberOfFrames",
}
"""Text that geometry and values come from. A canary in it is refused, or chooses the series."""

SCENE = """
name = "small"
[source]
path = "scan of {canary}"
[render]
picture_size = 16
[tolerance]
rmse = 1.0
maximum = 1.0
[[transfer]]
name = "grey"
points = [
    {{ value = 0.0, colour = "#000000", extinction_per_mm = 0.0 }},
    {{ value = 900.0, colour = "#ffffff", extinction_per_mm = 0.5 }},
]
"""


def filled(data: Dataset) -> Dataset:
    """Give the image with a canary in every text attribute of the standard, in private ones, and in sequences."""
    person = Dataset()
    person.PatientName = CANARY
    person.add_new((0x0040, 0xA160), "UT", CANARY)
    for tag, (kind, _, _, _, keyword) in DicomDictionary.items():
        if kind in TEXT_KINDS and keyword not in NEEDED and Tag(tag).group > 2:
            # Without types in the file, a reader takes each for what the standard says it is.
            data[tag] = DataElement(tag, "UT", CANARY)
        elif kind == "SQ" and "FunctionalGroups" not in keyword and keyword != "ModalityLUTSequence":
            data[tag] = DataElement(tag, "SQ", Sequence([person]))
    for group in (0x0009, 0x0019, 0x0029, 0x00E1):
        data.add_new((group, 0x0010), "LO", CANARY)
        for element in (0x1008, 0x100A, 0x1010, 0x10F0):
            data[group, element] = DataElement((group, element), "UT", CANARY)
    data.BurnedInAnnotation = "YES"
    return data


def small_voxels() -> np.ndarray:
    z, y, x = np.indices((5, 7, 8))
    return (np.hypot(np.hypot(z - 2, y - 3), x - 4) * 100).astype("<i2")


@pytest.fixture(scope="module")
def place(tmp_path_factory) -> Path:
    """A scene, and a series with canaries everywhere, in a folder whose name is one."""
    folder = tmp_path_factory.mktemp("place")
    scan = folder / f"scan of {CANARY}"
    voxels = small_voxels()
    with quiet_pydicom():
        data = filled(image(voxels[0]))
    for k, pixels in enumerate(voxels):
        with quiet_pydicom():
            data.ImagePositionPatient = ["0", "0", str(2 * k)]
            data.PixelData = pixels.tobytes()
            file = save(data, scan / f"{CANARY} {k}", ImplicitVRLittleEndian)
        file.write_bytes(CANARY.encode().ljust(128, b" ") + file.read_bytes()[128:])
    (folder / "small.toml").write_text(SCENE.format(canary=CANARY), encoding="utf-8")
    return folder


def has_canary(data: bytes) -> bool:
    name = CANARY.split("^", maxsplit=1)[0]
    return any(name.encode(code).lower() in data.lower() for code in ("utf-8", "utf-16-le", "utf-16-be"))


def canaries_in(folder: Path) -> list[Path]:
    """What in a folder has a canary: in its name, or in its bytes."""
    paths = list(folder.rglob("*"))
    assert any(path.is_file() for path in paths)
    return [
        path for path in paths if has_canary(path.name.encode()) or (path.is_file() and has_canary(path.read_bytes()))
    ]


def spoken(done: subprocess.CompletedProcess[str]) -> str:
    assert done.returncode == 0, done.stderr
    return done.stdout + done.stderr


def test_the_series_is_full_of_canaries(place) -> None:
    file = next((place / f"scan of {CANARY}").iterdir())
    assert file.read_bytes().count(CANARY.encode()) > 3000


def test_no_canary_reaches_package_report_or_screen(place) -> None:
    commands = [
        ("build", "small.toml", "-o", "small.volpkg"),
        ("inspect", "small.volpkg"),
        ("inspect", "small.volpkg", "--json"),
        ("plan", "small.toml"),
        ("validate", "small.volpkg", "--json"),
        ("import", "small.toml", "-o", "draft.volpkg", "--json"),
    ]
    said = {" ".join(command): spoken(volprep(*command, cwd=place)) for command in commands}
    assert not [command for command, text in said.items() if has_canary(text.encode())]
    written = [path for name in ("small.volpkg", "small.report") for path in (place / name).rglob("*")]
    assert {"manifest.json", "report.json", "index.html"} <= {path.name for path in written}
    assert not [path for name in ("small.volpkg", "small.report", "draft.volpkg") for path in canaries_in(place / name)]
    origin = (place / "small.volpkg.origin.json").read_text(encoding="utf-8")
    assert origin.count("CANARY") == 1, "the path of the scan, in the file that stays behind"
    assert "note: warning: the series says that text is burned into" in said["build small.toml -o small.volpkg"]


def test_the_list_of_series_has_no_canary(place) -> None:
    text = spoken(volprep("import", ".", "--list", cwd=place / f"scan of {CANARY}"))
    assert "a volume" in text
    assert not has_canary(text.encode())


def nifti_of(folder: Path) -> Path:
    path = folder / f"{CANARY}-1970.nii"
    header = nibabel.Nifti1Header()
    header["descrip"] = header["aux_file"] = header["intent_name"] = header["db_name"] = CANARY.encode()
    nibabel.save(nibabel.Nifti1Image(small_voxels().T, np.diag([1.0, 1.0, 2.0, 1.0]), header), path)
    return path


def nrrd_of(folder: Path) -> Path:
    path = folder / f"{CANARY}-1970.nrrd"
    head = f"NRRD0005\n# {CANARY}\ntype: int16\ndimension: 3\nsizes: 8 7 5\nspacings: 1 1 2\n"
    head += f"encoding: raw\nendian: little\ncontent: {CANARY}\nPatient:={CANARY}\n\n"
    path.write_bytes(head.encode() + small_voxels().tobytes())
    return path


def metaimage_of(folder: Path) -> Path:
    path = folder / f"{CANARY}-1970.mha"
    head = f"ObjectType = Image\nNDims = 3\nComment = {CANARY}\nDimSize = 8 7 5\nElementSpacing = 1 1 2\n"
    head += "Offset = 0 0 0\nElementType = MET_SHORT\nElementDataFile = LOCAL\n"
    path.write_bytes(head.encode() + small_voxels().tobytes())
    return path


def series_of(folder: Path) -> Path:
    path = folder / f"{CANARY} 1970"
    with quiet_pydicom():
        data = filled(image(small_voxels()[0]))
        for k, pixels in enumerate(small_voxels()):
            data.ImagePositionPatient = ["0", "0", str(2 * k)]
            data.PixelData = pixels.tobytes()
            save(data, path / f"{CANARY} {k}", ImplicitVRLittleEndian)
    return path


BEGUN = ["import {scan} -o d.volpkg", "inspect d.volpkg --json"]
MADE = [
    "import {scan} -o d.volpkg --json",
    "plan {scan} --json",
    "build {scan} -o a.volpkg",
    "zip a.volpkg",
    "export d.volpkg a.nii",
]


@pytest.mark.long(keep=1)
@pytest.mark.parametrize(
    ("scan_of", "commands"), [(nifti_of, BEGUN), (nrrd_of, BEGUN), (metaimage_of, BEGUN), (series_of, MADE)]
)
def test_a_scan_without_a_scene_gives_its_name_to_nothing(tmp_path, scan_of, commands) -> None:
    home = tmp_path / f"home of {CANARY}"
    home.mkdir()
    scan = scan_of(home)
    away = tmp_path / "away"
    away.mkdir()
    words = {command: [word.format(scan=scan) for word in command.split()] for command in commands}
    said = {command: spoken(volprep(*words[command], cwd=away)) for command in commands}
    assert not [command for command, text in said.items() if has_canary(text.encode())]
    made = [json.loads(path.read_text(encoding="utf-8")) for path in away.glob("*.volpkg/manifest.json")]
    assert {manifest["name"] for manifest in made} == {"scan"}
    told = sorted(away.glob("*.volpkg.origin.json"))
    assert len(told) == len(made)
    assert sorted(canaries_in(away)) == told, "the path of the scan, in the files that stay behind"


@pytest.mark.long
def test_a_draft_that_was_moved_without_its_origin_goes_on_to_a_package(place, tmp_path) -> None:
    spoken(volprep("import", "small.toml", "-o", tmp_path / "d.volpkg", cwd=place))
    moved = tmp_path / "elsewhere" / "m.volpkg"
    moved.parent.mkdir()
    (tmp_path / "d.volpkg").rename(moved)
    for verb in ("quantize", "pyramid", "transfer", "texture", "skip", "shaders", "seal"):
        done = volprep("stage", verb, moved)
        assert not has_canary((done.stdout + done.stderr).encode())
        assert not canaries_in(moved)
        assert done.returncode == 0 or "VP3023" in done.stderr, done.stderr
    spoken(volprep("validate", moved, "--quick"))
    refused = volprep("validate", moved)
    assert "VP6012" in refused.stderr, "the scan that it was made from is not known"
