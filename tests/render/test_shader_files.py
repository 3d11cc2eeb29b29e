"""The parts that shaders are made of."""

import re
from pathlib import Path

import pytest

import volprep.shading.compose

FOLDER = Path(volprep.shading.compose.__file__).parent / "glsl"
PARTS = sorted(FOLDER.glob("**/*.glsl"))


def test_there_are_few_enough_parts_to_know_them_all():
    assert 0 < len(PARTS) <= 60


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
