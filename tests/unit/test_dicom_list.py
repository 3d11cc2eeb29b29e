"""The list of the series in a folder tree: what each is, what is wrong with it, and nothing that names a person."""

import json
from pathlib import Path

import pytest
from command_line import volprep
from dicom_files import save_all, stack

from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent
from volprep_formats.readers.dicom.listing import Listing, list_series

CANARY = "CANARY JANE"


def series(uid: str, count: int, **attributes) -> list:
    images = stack(count)
    for data in images:
        data.SeriesInstanceUID = uid
        data.PatientName = data.SeriesDescription = data.ProtocolName = CANARY
        for keyword, value in attributes.items():
            setattr(data, keyword, value)
    return images


@pytest.fixture(scope="module")
def tree(tmp_path_factory) -> Path:
    """A volume, one with a missing slice, colour pictures, a file that is cut off, and a file of another kind."""
    folder = tmp_path_factory.mktemp("tree")
    save_all(series("1.2.30000001", 5, Modality="CT"), folder / "a")
    holed = series("1.2.30000002", 6)
    del holed[2]
    save_all(holed, folder / "a" / "b")
    save_all(series("1.2.3.4", 2, SamplesPerPixel=3, PhotometricInterpretation="RGB"), folder / "c")
    (folder / "readme.txt").write_text("text")
    return folder


def listed(folder: Path) -> Listing:
    return list_series(folder, Silent())


def test_every_series_is_listed_with_what_it_is(tree) -> None:
    found = listed(tree)
    assert [(s.uid, s.ending, s.files, s.modality) for s in found.series] == [
        ("1.2.3.4", "1.2.3.4", 2, "MR"),
        ("1.2.30000001", "30000001", 5, "CT"),
        ("1.2.30000002", "30000002", 5, "MR"),
    ]
    assert [[p.code for p in s.problems] for s in found.series] == [["VP1035"], [], ["VP2014"]]
    assert found.series[1].shape_zyx == (5, 3, 4)
    assert found.series[1].spacing_mm_zyx == (2.5, 1.0, 1.0)
    assert found.series[2].spacing_mm_zyx == (None, 1.0, 1.0)
    assert (found.damaged, found.other_files) == ((), 1)


def test_a_damaged_file_is_listed_and_does_not_hide_the_rest(tree, tmp_path) -> None:
    save_all(series("1.2.9", 5), tmp_path)
    file = tmp_path / "I002"
    file.write_bytes(file.read_bytes()[:200])
    found = listed(tmp_path)
    assert [problem.code for problem in found.damaged] == ["VP1031"]
    assert str(file) in found.damaged[0].summary
    assert [s.files for s in found.series] == [4]


def test_endings_are_as_long_as_it_takes_to_tell_series_apart(tmp_path) -> None:
    save_all(series("1.2.7.12345678", 4), tmp_path / "a")
    save_all(series("1.2.8.12345678", 4), tmp_path / "b")
    assert [s.ending for s in listed(tmp_path).series] == ["7.12345678", "8.12345678"]


def test_a_folder_without_dicom_is_refused(tmp_path) -> None:
    with pytest.raises(VolprepError, match="VP1030"):
        listed(tmp_path)


@pytest.mark.long
def test_the_command_lists_without_names_and_writes_nothing(tree) -> None:
    before = sorted(tree.rglob("*"))
    text, data = volprep("import", tree, "--list"), volprep("import", tree, "--list", "--json")
    assert (text.returncode, data.returncode) == (0, 0)
    assert "30000001  CT        5      4×3×5   1 × 1 × 2.5  a volume" in text.stdout
    assert "VP2014" in text.stdout
    assert Listing.model_validate(json.loads(data.stdout), strict=False) == listed(tree)
    assert not [said for said in (text.stdout, text.stderr, data.stdout, data.stderr) if CANARY in said]
    assert sorted(tree.rglob("*")) == before


def test_the_command_imports_the_series_that_is_named(tree, tmp_path) -> None:
    done = volprep("import", tree, "--series", "30000001", "-o", tmp_path / "x.volpkg", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["source"]["info"]["grid"]["shape_zyx"] == [5, 3, 4]
    refused = volprep("import", tree, "--series", "7", "-o", tmp_path / "y.volpkg")
    assert (refused.returncode, "VP1034" in refused.stderr) == (3, True)


def test_a_draft_needs_a_place_to_go(tree) -> None:
    refused = volprep("import", tree)
    assert refused.returncode == 2
    assert "'-o' / '--output'" in refused.stderr


def test_all_faults_of_a_series_are_listed_not_the_first(tmp_path) -> None:
    faulty = series("1.2.5", 8)
    faulty[1].RescaleSlope, faulty[1].RescaleIntercept = "0", "1"
    faulty[2].PixelData = faulty[2].PixelData[:4]
    del faulty[5]
    save_all(faulty, tmp_path)
    (found,) = listed(tmp_path).series
    codes = [problem.code for problem in found.problems]
    assert len(codes) == len(set(codes)) == 3
    assert "VP2014" in codes


def test_a_localiser_is_named_and_its_orientations_too(tmp_path) -> None:
    scout = series("1.2.6", 3, ImageType=["ORIGINAL", "PRIMARY", "LOCALIZER"])
    scout[1].ImageOrientationPatient = [1, 0, 0, 0, 0, -1]
    scout[2].ImageOrientationPatient = [0, 1, 0, 0, 0, -1]
    for data in scout[1:]:
        data.PixelSpacing = [3.0, 3.0]
    save_all(scout, tmp_path)
    (found,) = listed(tmp_path).series
    assert found.is_localiser
    (problem,) = found.problems
    assert problem.code == "VP2003"
    assert "which is axial" in problem.summary
    assert "which is coronal" in problem.summary or "which is sagittal" in problem.summary
    assert "a localiser of 3 slices: VP2003" in volprep("import", tmp_path, "--list").stdout


def test_a_scout_of_one_slice_is_not_built_silently(tmp_path) -> None:
    save_all(series("1.2.7", 1, ImageType=["ORIGINAL", "PRIMARY", "LOCALIZER"], SliceThickness="2"), tmp_path / "in")
    done = volprep("import", tmp_path / "in", "-o", tmp_path / "a.volpkg")
    assert (done.returncode, "localiser (scout) of 1 slice" in done.stderr) == (0, True), done.stderr


def test_descriptions_are_for_the_screen_alone(tree) -> None:
    shown = list_series(tree, Silent(), described=True)
    assert {each.description for each in shown.series} == {CANARY}
    assert CANARY not in shown.model_dump_json()
    assert CANARY not in volprep("import", tree, "--list").stdout
