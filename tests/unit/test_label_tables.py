"""Label tables: what other programs write is read, and the built-in ones hold the numbers of their programs."""

from pathlib import Path

import nibabel
import numpy as np
import pytest

from volprep_formats.diagnostics import VolprepError
from volprep_formats.label_tables import built_in, companion_table, read_label_table
from volprep_formats.label_tables.hints import label_hint
from volprep_formats.label_tables.nifti import table_text
from volprep_formats.label_tables.parse import parse_table
from volprep_formats.label_tables.table import LabelEntry

FREESURFER = (
    "#No. Label Name: R G B A\n\n0 Unknown 0 0 0 0\n17  Left-Hippocampus  220 216 20 0\n53 Right-Hippocampus 1 2 3 0\n"
)
ITKSNAP = '0 0 0 0 0 0 0 "Clear Label"\n1 255 0 0 1 1 1 "Label 1"\n2 0 255 0 0.5 0 1 "Hidden one"\n'
SLICER = 'LabelValue,Name,Color_R,Color_G,Color_B,Color_A\n4,"vein, large",1,2,3,255\n'
BIDS = "index\tname\tabbreviation\tcolor\n1\tgrey matter\tGM\t#ff0000\n2\twhite matter\tWM\t\n"
FSL = '<atlas><header><type>Label</type></header><data><label index="3" x="1">Left &amp; right</label></data></atlas>'
FSL_MAXIMA = FSL.replace(">Label<", ">Probabilistic<")
SPM = "<atlas><data><label><index>2001</index><name>Precentral_L</name></label></data></atlas>"
CARET = """<CaretExtension><VolumeInformation><LabelTable>
<Label Key="5" Red="0.0" Green="1" Blue="0.5" Alpha="1"><![CDATA[liver]]></Label>
<Label Key="7" Red="2" Green="0">left &amp; right</Label><Label Key="x">no number</Label>
</LabelTable></VolumeInformation></CaretExtension>"""
AAL = "1 Precentral_L 2001\n2 Precentral_R 2002\n"
TALAIRACH = "0\tBackground\n1\tLeft Cerebrum.*.*.*.*\n659\tRight.*.*\n"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (FREESURFER, [(17, "Left-Hippocampus", "#dcd814", 1.0), (53, "Right-Hippocampus", "#010203", 1.0)]),
        (ITKSNAP, [(1, "Label 1", "#ff0000", 1.0), (2, "Hidden one", "#00ff00", 0.0)]),
        (SLICER, [(4, "vein, large", "#010203", 1.0)]),
        (BIDS, [(1, "grey matter", "#ff0000", 1.0), (2, "white matter", None, 1.0)]),
        (FSL, [(3, "Left & right", None, 1.0)]),
        (FSL_MAXIMA, [(4, "Left & right", None, 1.0)]),
        (SPM, [(2001, "Precentral_L", None, 1.0)]),
        (CARET, [(5, "liver", "#00ff80", 1.0), (7, "left & right", None, 1.0)]),
        (AAL, [(1, "Precentral_L", None, 1.0), (2, "Precentral_R", None, 1.0)]),
        (TALAIRACH, [(1, "Left Cerebrum.*.*.*.*", None, 1.0), (659, "Right.*.*", None, 1.0)]),
    ],
)
def test_tables_of_other_programs_are_read(text: str, expected: list[tuple[int, str, str | None, float]]) -> None:
    found = parse_table(text)
    assert [(entry.number, entry.name, entry.opacity) for entry in found] == [
        (n, name, o) for n, name, _, o in expected
    ]
    assert all(colour in {None, entry.colour} for entry, (_, _, colour, _) in zip(found, expected, strict=True))


@pytest.mark.parametrize("text", ["", "3 slices are missing\nsee the notes\nand the report\n", "\0" * 99, "1 only\n"])
def test_a_text_that_is_no_table_has_no_entries(text: str) -> None:
    assert parse_table(text) == []


@pytest.mark.parametrize(
    ("table", "expected"),
    [
        ("freesurfer", LabelEntry(17, "Left-Hippocampus", "#dcd814")),
        ("freesurfer", LabelEntry(2035, "ctx-rh-insula", "#ffc020")),
        ("freesurfer", LabelEntry(3001, "wm-lh-bankssts", "#e69bd7")),
        ("freesurfer", LabelEntry(14101, "wm_rh_G_and_S_frontomargin", "#17dc3c")),
        ("slicer", LabelEntry(216, "liver", "#dd8265")),
        ("itksnap", LabelEntry(4, "Label 4", "#ffff00")),
    ],
)
def test_built_in_tables_have_the_numbers_of_their_programs(table: str, expected: LabelEntry) -> None:
    assert built_in(table).by_number[expected.number] == expected


def test_a_table_lies_beside_the_scan_under_its_name(tmp_path: Path) -> None:
    scan = tmp_path / "atlas.nii.gz"
    assert companion_table(scan) is None
    (tmp_path / "atlas.nii.txt").write_text(AAL)
    assert companion_table(scan) == tmp_path / "atlas.nii.txt"


@pytest.mark.parametrize("kind", [nibabel.Nifti1Image, nibabel.Nifti2Image])
@pytest.mark.parametrize("name", ["map.nii", "map.nii.gz"])
def test_the_table_inside_a_nifti_file_is_found(tmp_path: Path, kind: type, name: str) -> None:
    image = kind(np.zeros((4, 3, 2), np.uint8), np.eye(4))
    path = tmp_path / name
    nibabel.save(image, path)
    assert companion_table(path) is None
    assert label_hint(path) == ""
    for text in (b"a note", CARET.encode()):
        image.header.extensions.append(nibabel.nifti1.Nifti1Extension(0, text))
    nibabel.save(image, path)
    assert companion_table(path) == path
    assert [each.name for each in read_label_table(path).entries] == ["liver", "left & right"]
    assert label_hint(path) == "the file holds a table of labels"


def test_a_nifti_file_that_ends_in_its_table_has_none(tmp_path: Path) -> None:
    image = nibabel.Nifti1Image(np.zeros((4, 3, 2), np.uint8), np.eye(4))
    image.header.extensions.append(nibabel.nifti1.Nifti1Extension(0, CARET.encode()))
    nibabel.save(image, tmp_path / "map.nii")
    whole = (tmp_path / "map.nii").read_bytes()
    for length in (0, 100, 348, 351, 356, 370):
        (tmp_path / "map.nii").write_bytes(whole[:length])
        assert table_text(tmp_path / "map.nii") == ""


def test_a_file_that_is_no_table_is_refused_by_name(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("no table\n")
    with pytest.raises(VolprepError, match=r"notes\.txt") as caught:
        read_label_table(tmp_path / "notes.txt")
    assert caught.value.code == "VP1300"
