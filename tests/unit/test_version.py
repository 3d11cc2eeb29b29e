"""The version is in pyproject.toml; other files repeat it for programs that read only them."""

import json
import re
import tomllib
from pathlib import Path

import pytest

import volprep
from volprep_cli.version import version_text

ROOT = Path(__file__).parents[2]
VERSION = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]


def found(file: str, pattern: str) -> str:
    """Return what the group of a pattern finds first in a file."""
    return re.search(pattern, (ROOT / file).read_text(encoding="utf-8"), re.MULTILINE)[1]


@pytest.mark.parametrize(
    ("file", "pattern"),
    [
        ("CITATION.cff", r"^version: (.*)$"),
        ("CHANGELOG.md", r"^## (\S+)"),
        ("formats/spec/example.md", r'"generator": "volprep (.*)",'),
    ],
)
def test_a_file_repeats_the_version_of_the_project(file: str, pattern: str) -> None:
    assert found(file, pattern) == VERSION


def test_the_library_and_the_command_say_the_version_of_the_project() -> None:
    assert volprep.__version__ == VERSION
    assert VERSION in version_text().split()


def test_the_npm_package_has_the_version_of_the_project() -> None:
    assert json.loads((ROOT / "formats/js/package.json").read_text())["version"] == VERSION


def test_the_c_header_has_the_version_of_the_project() -> None:
    major, minor, patch = map(int, VERSION.split("."))
    number = found("formats/c/volpkg.h", r"^#define VOLPKG_HEADER_VERSION (\d+)$")
    assert int(number) == 10000 * major + 100 * minor + patch
