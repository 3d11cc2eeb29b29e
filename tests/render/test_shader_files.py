"""The parts that shaders are made of."""

import re
from pathlib import Path

import pytest

import volprep.shading.compose
from volprep.shading.compose import Instance, compose
from volprep_formats.diagnostics import VolprepError

FOLDER = Path(volprep.shading.compose.__file__).parent / "glsl"
PARTS = sorted(FOLDER.glob("**/*.glsl"))


def test_there_are_few_enough_parts_to_know_them_all():
    assert 0 < len(PARTS) <= 94


@pytest.mark.parametrize("path", PARTS, ids=lambda path: path.stem)
def test_a_part_begins_by_saying_what_it_is(path):
    text = path.read_text(encoding="utf-8")
    assert text.startswith("//: ")
    assert text.isascii()
    assert text.endswith("\n")
    assert all(len(line) <= 120 for line in text.splitlines())


@pytest.mark.parametrize("path", PARTS, ids=lambda path: path.stem)
def test_every_section_of_a_part_closes_what_it_opens(path):
    for section in re.split(r"^//#section \w+\n", path.read_text(encoding="utf-8"), flags=re.MULTILINE):
        code = re.sub(r"//.*", "", section)
        # A word in braces is no block.
        code = re.sub(r"\$\{\w+\}", "WORD", code)
        depth = {"{": 0, "(": 0, "[": 0}
        for character in code:
            if character in "{([":
                depth[character] += 1
            elif character in "})]":
                opened = "{(["["})]".index(character)]
                depth[opened] -= 1
                assert depth[opened] >= 0, f"{character} closes what another part opens"
        assert not any(depth.values()), f"{depth} left open"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder of parts that a test writes."""
    monkeypatch.setattr(volprep.shading.compose, "_FOLDER", tmp_path)
    return tmp_path


def test_a_section_ends_where_the_next_one_begins_and_is_indented_as_its_slot(folder):
    (folder / "feature.glsl").write_text(
        "//: Head.\nfloat of_all;\n//#section start\n//: Not shipped.\nfloat a;\n//#section end\nfloat b;\n"
    )
    (folder / "main.glsl").write_text("//#part declared\nvoid main() {\n  //#part first\n  //#part last\n}\n")
    slots = {"declared": "feature", "first": "feature:start", "last": "feature:end"}
    text = "#version 100\nfloat of_all;\nvoid main() {\n  float a;\n  float b;\n}\n"
    assert compose("main", "es100", slots, {}) == text


def test_instances_have_words_slots_and_lists_of_their_own(folder):
    (folder / "thing.glsl").write_text(
        "//#each UNIT\nuniform float u_$NAME$UNIT;\n//#end\nfloat $NAME() {\n  //#part body\n}\n"
    )
    (folder / "body.glsl").write_text("return $VALUE;\n")
    (folder / "other.glsl").write_text("return 2.0;\n")
    things = (
        Instance("thing", {"NAME": "one", "UNIT": "0 1", "VALUE": "1.0"}, {"body": "body"}),
        Instance("thing", {"NAME": "two", "UNIT": "2"}, {"body": "other"}),
    )
    assert compose(things, "es300", {}, {}) == (
        "#version 300 es\nuniform float u_one0;\nuniform float u_one1;\nfloat one() {\n  return 1.0;\n}\n"
        "\nuniform float u_two2;\nfloat two() {\n  return 2.0;\n}\n"
    )


def test_a_word_that_an_instance_does_not_use_is_an_error(folder):
    (folder / "thing.glsl").write_text("float $NAME;\n")
    with pytest.raises(VolprepError, match=r"VP9001 .*\['VALUE'\]"):
        compose((Instance("thing", {"NAME": "one", "VALUE": "1.0"}),), "es300", {}, {})
