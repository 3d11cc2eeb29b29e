import re
import string
from pathlib import Path

import pytest

from volprep_formats.diagnostics import CATALOGUE, ExitStatus, VolprepError

ROOT = Path(__file__).parents[2]
CODE = re.compile(r"\"(VP\d{4})\"")


def raised_codes() -> set[str]:
    """Every code that stands in the sources outside the catalogue."""
    files = [
        file
        for layer in ("volprep", "formats/volprep_formats", "cli/volprep_cli")
        for file in (ROOT / layer).rglob("*.py")
        if file.parent.name != "diagnostics"
    ]
    return {code for file in files for code in CODE.findall(file.read_text(encoding="utf-8"))}


def test_every_code_that_is_raised_is_in_the_catalogue_and_none_is_there_for_nothing() -> None:
    assert raised_codes() == set(CATALOGUE)


def test_codes_stand_in_order() -> None:
    assert list(CATALOGUE) == sorted(CATALOGUE)


@pytest.mark.parametrize("code", CATALOGUE)
def test_an_entry_says_what_is_wrong_and_what_to_do(code) -> None:
    entry = CATALOGUE[code]
    assert entry.status != ExitStatus.OK
    assert entry.summary
    assert not entry.summary.endswith(".")
    assert entry.remedy.endswith((".", "}"))


@pytest.mark.parametrize("code", CATALOGUE)
def test_an_error_fills_its_texts(code) -> None:
    entry = CATALOGUE[code]
    names = {
        name.split(".")[0].split("[")[0]
        for text in (entry.summary, entry.remedy)
        for _, name, _, _ in string.Formatter().parse(text)
        if name
    }
    error = VolprepError(code, **dict.fromkeys(names, 7))
    assert str(error).startswith(f"{code} ")
    assert "{" not in str(error)
    assert error.status == entry.status
