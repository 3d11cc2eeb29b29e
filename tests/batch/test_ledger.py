"""One final record for each job, whatever dies while it is written."""

import errno
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from string import Formatter

import pytest

from volprep.batch import ledger as ledger_module
from volprep.batch.ledger import Ledger, beginning_of
from volprep.batch.place import Place
from volprep.batch.records import JobRecord, job_error, unexpected
from volprep_formats.diagnostics import CATALOGUE, ExitStatus, VolprepError

DIGEST = "0" * 64


def record(name: str, **changes: object) -> JobRecord:
    fields = {"outcome": "built", "source_stamp": DIGEST, "scene_sha256": DIGEST, "version": "1", "ended": "now"}
    return JobRecord.model_validate({"name": name, "profile": "gles3", **fields, **changes})


@pytest.fixture
def ledger(tmp_path: Path) -> Ledger:
    place = Place(tmp_path)
    place.prepare()
    return Ledger(place)


def test_the_last_record_of_a_job_counts(ledger) -> None:
    for each in (record("a", retries=1), record("b"), record("a", retries=2)):
        ledger.append(each)
    assert ledger.last("a", "gles3") == record("a", retries=2)
    assert ledger.records() == {("a", "gles3"): record("a", retries=2), ("b", "gles3"): record("b")}
    assert ledger.last("c", "gles3") is None
    assert ledger.last("a", "gles2-2048") is None


def test_tidying_leaves_one_line_for_each_job(ledger) -> None:
    for each in (record("b"), record("a", retries=1), record("a", retries=2)):
        ledger.append(each)
    ledger.tidy()
    assert [line[:11] for line in ledger.place.ledger.read_text(encoding="ascii").splitlines()] == [
        '{"name": "a',
        '{"name": "b',
    ]


@pytest.mark.parametrize("kept", [1, 30, 200])
def test_a_line_torn_by_a_kill_is_no_record_and_spoils_none_after_it(ledger, kept) -> None:
    ledger.append(record("a"))
    whole = ledger.place.ledger.read_bytes()
    ledger.place.ledger.write_bytes(whole + whole.replace(b'"a"', b'"torn"')[:kept])
    assert set(ledger.records()) == {("a", "gles3")}
    assert ledger.last("torn", "gles3") is None
    ledger.append(record("b"))
    assert set(ledger.records()) == {("a", "gles3"), ("b", "gles3")}


def test_a_torn_line_longer_than_a_block_is_removed(ledger) -> None:
    ledger.append(record("a"))
    with ledger.place.ledger.open("ab") as file:
        file.write(b"x" * 10_000)
    ledger.append(record("b"))
    assert set(ledger.records()) == {("a", "gles3"), ("b", "gles3")}


def test_many_writers_lose_no_record(ledger) -> None:
    names = [f"n{number}" for number in range(60)]
    with ThreadPoolExecutor(8) as pool:
        for name, _ in zip(names, pool.map(lambda each: ledger.append(record(each)), names), strict=True):
            assert ledger.last(name, "gles3") is not None
    assert len(ledger.place.ledger.read_bytes().splitlines()) == 60


def test_what_others_do_to_the_file_is_seen(ledger) -> None:
    """Lines are added, torn, replaced by those of another file, taken away: what a process remembers follows."""
    path = ledger.place.ledger
    for name in ("b", "a", "longer", "z"):
        ledger.append(record(name))
    assert ledger.last("a", "gles3") == record("a")
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join([lines[2], *lines[:2], lines[3]]))  # the same file, another order
    assert ledger.last("b", "gles3") == record("b")
    assert ledger.last("a", "gles3") == record("a")
    first = lines[0].replace(b'"b"', b'"first"')
    path.with_suffix(".new").write_bytes(b"".join([first, *lines]))
    path.with_suffix(".new").replace(path)
    assert ledger.last("first", "gles3") == record("first")
    with path.open("ab") as file:
        file.write(lines[0].replace(b'"b"', b'"c"')[:-9])
    assert ledger.last("c", "gles3") is None
    ledger.append(record("c", retries=1))
    assert ledger.last("c", "gles3") == record("c", retries=1)
    ledger.append(record("b", retries=2))
    ledger.tidy()
    assert ledger.last("b", "gles3") == record("b", retries=2)
    path.write_bytes(lines[1])
    assert ledger.last("c", "gles3") is None
    assert ledger.last("a", "gles3") == record("a")
    path.unlink()
    assert ledger.last("a", "gles3") is None


@pytest.mark.parametrize("name", ['q"u', 'a", "profile": "x", ', "back\\", "é"])
def test_a_line_is_found_whatever_its_name_holds(ledger, name) -> None:
    for each in ("a", name, "b"):
        ledger.append(record(each))
    assert ledger.last(name, "gles3") == record(name)
    assert ledger.last("b", "gles3") == record("b")


def test_a_process_reads_only_what_is_new_to_it(ledger, monkeypatch) -> None:
    ledger.append(record("a"))
    assert ledger.last("a", "gles3") is not None
    looked: list[bytes] = []
    monkeypatch.setattr(ledger_module, "beginning_of", lambda line: looked.append(line) or beginning_of(line))
    ledger.append(record("b"))
    assert ledger.last("b", "gles3") == record("b")
    assert ledger.last("a", "gles3") == record("a")
    assert [line[:11] for line in looked] == [b'{"name": "b']


def test_a_line_that_is_no_record_is_named(ledger) -> None:
    ledger.append(record("a"))
    with ledger.place.ledger.open("ab") as file:
        file.write(b'{"name": "b"}\n')
    ledger.append(record("c"))
    passed: list[VolprepError] = []
    assert [name for name, _ in ledger.records(passed)] == ["a", "c"]
    assert [(error.code, error.fields["line"]) for error in passed] == [("VP8010", 2)]
    assert ledger.last("b", "gles3") is None
    ledger.tidy()
    assert ledger.place.ledger.read_bytes().count(b"\n") == 2


def test_a_recorded_error_keeps_numbers_and_no_text_from_outside() -> None:
    error = VolprepError("VP1030", path=Path("/scans/JANE"), files=7345)
    found = job_error(error, "scan-1")
    assert "JANE" not in found.summary + found.remedy
    assert found.summary.startswith("scan-1: ")
    assert "7345" in found.summary
    named = job_error(VolprepError("VP1007", path="JANE", text="JANE", dtype="JANE"), "scan-1")
    assert "JANE" not in named.summary + named.remedy


def test_every_code_can_be_recorded_whatever_text_its_fields_hold() -> None:
    for code, entry in CATALOGUE.items():
        texts = f"{entry.summary} {entry.remedy}"
        # A field with a format of numbers is a number.
        names = {name: 7 if spec and spec[-1] in "gfd" else "JANE" for _, name, spec, _ in Formatter().parse(texts)}
        error = VolprepError(code, **{name.split(".")[0].split("[")[0]: value for name, value in names.items() if name})
        found = job_error(error, "scan-1")
        assert "JANE" not in found.summary + found.remedy


def test_what_the_system_says_is_kept_in_a_record() -> None:
    assert "No space left" in unexpected(OSError(errno.ENOSPC, "x", "/scans/JANE"), "scan-1").summary
    assert unexpected(OSError(errno.ENOSPC, "x"), "scan-1").code == "VP4020"
    assert "JANE" not in unexpected(OSError(errno.EACCES, "x", "/scans/JANE"), "scan-1").summary
    defect = unexpected(ZeroDivisionError("JANE"), "scan-1")
    assert "ZeroDivisionError" in defect.summary
    assert "JANE" not in defect.summary


def test_a_job_that_failed_has_the_status_of_its_error_and_one_beyond_its_tolerance_has_1() -> None:
    error = job_error(VolprepError("VP8021", path="a", limit_s=1.0, times=2), "a")
    assert record("a", outcome="failed", errors=(error,)).status == ExitStatus.SOURCE
    assert record("a", verdict="beyond").status == ExitStatus.TOLERANCE
    assert record("a", verdict="within").status == ExitStatus.OK
    unknown = error.model_copy(update={"code": "VP8999"})
    assert record("a", outcome="failed", errors=(unknown,)).status == ExitStatus.INTERNAL
