import json
import re
import string
from pathlib import Path

import pytest

from volprep_formats.diagnostics import CATALOGUE, ExitStatus, Lines, VolprepError

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
    files += [*(ROOT / "formats" / "js").rglob("*.js"), *(ROOT / "volprep" / "view" / "page").glob("*.js")]
    found = {code for file in files for code in CODE.findall(file.read_text(encoding="utf-8"))}
    header = (ROOT / "formats" / "c" / "volpkg.h").read_text(encoding="utf-8")
    return found | {f"VP{number}" for number in re.findall(r"^    VOLPKG_\w+ = (\d{4})\b", header, re.MULTILINE)}


def test_every_code_that_is_raised_is_in_the_catalogue_and_none_is_there_for_nothing() -> None:
    assert raised_codes() == set(CATALOGUE)


def test_codes_stand_in_order_in_their_files_and_once() -> None:
    files = sorted((ROOT / "formats" / "volprep_formats" / "diagnostics").glob("*.py"))
    codes = [re.findall(r"^(VP\d{4}) ", file.read_text(encoding="utf-8"), re.MULTILINE) for file in files]
    assert codes == [sorted(set(of_file)) for of_file in codes]
    assert sum(map(len, codes)) == len(CATALOGUE)


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


HOSTILE = "a\x1b[2Jb\nvolprep: VP0000 all is well\u202ec\udcff\x07"


@pytest.mark.parametrize("value", [HOSTILE, Path(HOSTILE), OSError(HOSTILE), [HOSTILE]])
def test_foreign_text_in_a_message_is_escaped_whatever_carries_it(value) -> None:
    message = str(VolprepError("VP1003", path=value, error=value))
    assert message.isprintable()
    assert "\\x1b[2J" in message
    json.dumps(message, ensure_ascii=False).encode()


def test_a_quoted_field_is_escaped_once() -> None:
    error = VolprepError("VP1007", path="p", text="x\x1b", dtype="uint8")
    assert "'x\\x1b'" in error.summary


def test_long_foreign_text_is_cut_and_keeps_its_beginning_and_its_end() -> None:
    error = VolprepError("VP1003", path="begin" + "x" * 100_000 + "end", error="e")
    assert len(str(error)) < 1200
    assert error.summary.startswith("begin")
    assert "end: cannot be read" in error.summary


def test_a_list_stays_a_list_and_no_line_of_it_can_add_another() -> None:
    found = Lines(["1.2.3, CT", "4.5\nvolprep: VP0000 all is well"])
    assert VolprepError("VP1033", path="p", count=2, found=found).remedy.splitlines()[1:] == [
        "  1.2.3, CT",
        "  4.5\\nvolprep: VP0000 all is well",
    ]


def test_a_list_of_very_many_lines_is_cut() -> None:
    found = Lines(str(n) for n in range(100_000))
    lines = VolprepError("VP1033", path="p", count=2, found=found).remedy.splitlines()
    assert len(lines) < 200
    assert lines[-1].startswith("  and 99")


def test_a_limit_of_memory_is_to_be_raised_to_what_is_needed() -> None:
    told = str(VolprepError("VP7004", limit_mb=4000.0, needed_mb=8000.0))
    assert re.findall(r"[0-9.]+ [GM]B", told) == ["4000 MB", "8000 MB", "8000 MB"]
