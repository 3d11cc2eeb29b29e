"""Transfer functions of other programs: what they give, and what is wrong with files that are none."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from volprep.scene.request import load_request
from volprep_formats.diagnostics import VolprepError
from volprep_formats.transfer_files import read_transfer_file

SLICER = """1
1
0.9
0.1
0.2
10
6 -1000 0 100 0.25 300 0.75
4 0 1 255 1
12 -1000 0 0 0 100 1 0.5 0 300 1 1 1
"""
PARAVIEW = [
    {
        "Name": "mine",
        "ColorSpace": "RGB",
        "RGBPoints": [0.0, 0.0, 0.0, 1.0, 100.0, 1.0, 0.0, 0.0],
        "Points": [0.0, 0.0, 0.5, 0.0, 50.0, 0.2, 0.5, 0.0, 50.0, 0.8, 0.5, 0.0],
    }
]
ITKSNAP = """################
# ITK-SnAP Label Description File
################
    0     0    0    0        0  0  0    "Clear Label"
    1   255    0    0        1  1  1    "Left ventricle"
    2     0  255    0      0.5  1  1    "Wall"
    5     0    0  255        1  0  1    "Hidden"
"""


def read(tmp_path, name, text):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return [(point.value, point.colour, point.opacity) for point in read_transfer_file(path)]


def test_slicer_gives_colour_and_opacity_at_all_points_of_either(tmp_path) -> None:
    assert read(tmp_path, "a.vp", SLICER) == [
        (-1000.0, (0.0, 0.0, 0.0), 0.0),
        (100.0, (1.0, 0.5, 0.0), 0.25),
        (300.0, (1.0, 1.0, 1.0), 0.75),
    ]


def test_paraview_keeps_its_jumps(tmp_path) -> None:
    found = read(tmp_path, "a.json", json.dumps(PARAVIEW))
    assert [(value, opacity) for value, _, opacity in found] == [(0.0, 0.0), (50.0, 0.2), (50.0, 0.8), (100.0, 0.8)]
    assert found[1][1] == found[2][1] == pytest.approx((0.5, 0.0, 0.5))


def test_itk_snap_gives_each_label_the_values_nearest_to_it(tmp_path) -> None:
    found = read(tmp_path, "a.txt", ITKSNAP)
    assert [value for value, *_ in found] == [-0.5, -0.5, 0.5, 0.5, 1.5, 1.5, 2.5, 2.5, 4.5, 4.5, 5.5, 5.5]
    red, green = (255 / 255, 0.0, 0.0), (0.0, 255 / 255, 0.0)
    assert found[3:8] == [(0.5, red, 1.0), (1.5, red, 1.0), (1.5, green, 0.5), (2.5, green, 0.5), (2.5, green, 0.0)]
    assert all(opacity == 0.0 for value, _, opacity in found if value > 4)


@pytest.mark.parametrize(
    ("name", "text", "problem"),
    [
        ("a.xml", "", "it ends in none of .vp, .json, .txt"),
        ("a.vp", "", "0 lines, expected 9"),
        ("a.vp", SLICER.replace("6 -1000", "8 -1000"), "scalar opacity: 8 numbers promised, 6 there"),
        ("a.vp", SLICER.replace("6 -1000 0 100 0.25 300", "5 -1000 0 100 0.25"), "scalar opacity: 5 numbers, expected"),
        ("a.vp", SLICER.replace("300 0.75", "90 0.75"), "scalar opacity: point 3 stands before point 2"),
        ("a.vp", SLICER.replace("300 0.75", "nan 0.75"), "'nan' is not a number"),
        ("a.vp", SLICER.replace("300 0.75", "1e999 0.75"), "'1e999' is not a number"),
        ("a.vp", SLICER.replace("300 0.75", "300 1.75"), "scalar opacity: point 3 has a colour or opacity outside"),
        ("a.json", "{", "Expecting property name"),
        ("a.json", "[" * 100000, "too deeply"),
        ("a.json", "[1]", "no list of colour maps"),
        ("a.json", json.dumps([PARAVIEW[0] | {"ColorSpace": "Lab"}]), "mixed in Lab, not in RGB"),
        ("a.json", json.dumps([PARAVIEW[0] | {"Points": None}]), "Points is missing"),
        ("a.json", json.dumps([PARAVIEW[0] | {"Points": [0, 0, 0.4, 0, 1, 1, 0.5, 0]}]), "are not linear"),
        ("a.json", json.dumps([PARAVIEW[0] | {"RGBPoints": [0, 0, 0]}]), "RGBPoints: 3 numbers, expected"),
        ("a.json", json.dumps([PARAVIEW[0] | {"RGBPoints": [True, 0, 0, 0]}]), "'True' is not a number"),
        ("a.json", json.dumps([PARAVIEW[0] | {"RGBPoints": [0, 0, 0, 0] * 5000}]), "more than 4096 points"),
        ("a.txt", "# nothing", "no labels"),
        ("a.txt", "1 2 3", "line 1: 3 fields, expected 7"),
        ("a.txt", ITKSNAP + "1 0 0 0 1 1 1 again", "line 8: label 1 occurs twice"),
        ("a.txt", "1.5 0 0 0 1 1 1 half", "line 1: 1.5 is no label"),
        ("a.txt", "1 0 256 0 1 1 1 bright", "colours go from 0 to 255"),
        ("a.txt", "\n".join(f"{n} 0 0 0 1 1 1 x" for n in range(4097)), "4097 labels, more than 4096"),
        ("a.txt", "x" * (1 << 20) + "x", "more than 1048576 bytes"),
    ],
)
def test_what_is_no_transfer_function_is_told(tmp_path, name, text, problem) -> None:
    with pytest.raises(VolprepError) as caught:
        read(tmp_path, name, text)
    assert caught.value.code == "VP3042"
    assert problem in caught.value.summary


def test_bytes_that_are_no_text_and_files_that_are_missing_are_told(tmp_path) -> None:
    (tmp_path / "a.vp").write_bytes(b"\xff\xfe")
    for name in ("a.vp", "none.vp"):
        with pytest.raises(VolprepError, match="VP3042"):
            read_transfer_file(tmp_path / name)


@given(st.sampled_from([(".vp", SLICER), (".json", json.dumps(PARAVIEW)), (".txt", ITKSNAP)]), st.data())
def test_damage_is_read_or_refused_with_its_code(tmp_path_factory, kind, data) -> None:
    ending, text = kind
    raw = bytearray(text.encode())
    for _ in range(data.draw(st.integers(1, 4))):
        raw[data.draw(st.integers(0, len(raw) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path_factory.getbasetemp() / f"damaged{ending}"
    path.write_bytes(raw[: data.draw(st.integers(0, len(raw)))])
    try:
        values = [point.value for point in read_transfer_file(path)]
    except VolprepError as error:
        if error.code != "VP3042":
            raise
    else:
        assert values == sorted(values)


def test_a_scene_takes_the_points_of_a_file_beside_it(tmp_path) -> None:
    (tmp_path / "bone.vp").write_text(SLICER, encoding="utf-8")
    scene = tmp_path / "scene.toml"
    scene.write_text(
        'name = "s"\n[source]\npath = "x"\n[[transfer]]\nname = "bone"\nfile = "bone.vp"\nreference_mm = 2.0\n',
        encoding="utf-8",
    )
    (transfer,) = load_request(scene).scene.transfer
    assert transfer.file is None
    assert (transfer.name, transfer.reference_mm, len(transfer.points)) == ("bone", 2.0, 3)
    assert transfer.resolved().points[1].extinction_per_mm == pytest.approx(0.1438, abs=1e-4)
