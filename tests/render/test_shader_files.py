"""The parts that shaders are made of."""

from pathlib import Path

import pytest

import volprep.shading.compose

PARTS = sorted((Path(volprep.shading.compose.__file__).parent / "glsl").glob("*.glsl"))


@pytest.mark.parametrize("path", PARTS, ids=lambda path: path.stem)
def test_a_part_begins_by_saying_what_it_is(path):
    text = path.read_text(encoding="utf-8")
    assert text.startswith("//: ")
    assert text.isascii()
    assert text.endswith("\n")
    assert all(len(line) <= 120 for line in text.splitlines())
