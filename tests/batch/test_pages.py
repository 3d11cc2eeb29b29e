"""What a batch shows: its page in a browser, from a file, and the bar on a terminal."""

import io
from types import SimpleNamespace

from browser import Browser
from rich.console import Console

from volprep.batch.page import page, write_pages
from volprep.batch.place import Place
from volprep.batch.records import JobRecord, job_error
from volprep.batch.work import TaskResult
from volprep_cli.batch_watch import BatchWatcher, bar_on, watching
from volprep_formats.diagnostics import VolprepError

DIGEST = "0" * 64


def record(name: str, **changes: object) -> JobRecord:
    fields = {"outcome": "built", "source_stamp": DIGEST, "scene_sha256": DIGEST, "version": "1", "ended": "now"}
    return JobRecord.model_validate(
        {"name": name, "profile": "gles3", "shape_zyx": (1, 2, 3), "size_bytes": 990, **fields, **changes}
    )


def failed(name: str, code: str, **fields: object) -> JobRecord:
    return record(name, outcome="failed", errors=(job_error(VolprepError(code, path=name, **fields), name),))


RECORDS = [
    record("a", size_bytes=10, seconds=3.0, verdict="within"),
    record("b", size_bytes=30, seconds=1.0, verdict="beyond"),
    record("b", size_bytes=20, seconds=2.0, profile="gles2-2048"),
    failed("c", "VP8020", times=2),
    failed("d", "VP8023"),
    failed("e", "VP8020", times=2),
]


def test_failures_are_grouped_by_code_with_what_to_do() -> None:
    text = page(RECORDS)
    first, second = text.index("<b>VP8020</b>, 2 scans"), text.index("<b>VP8023</b>, 1 scan")
    assert first < second
    assert "What to do:</b> Wait until the files are complete" in text[second:]
    assert text.index("What to do:</b> Build this scan alone") < second
    assert "<li>d, gles3: " in text
    assert "<li>d, gles3: d: " not in text
    assert "volprep batch --explain NAME" in text[:first]


def test_the_page_filters_and_sorts_from_a_file(tmp_path) -> None:
    (tmp_path / "out").mkdir()
    write_pages(Place(tmp_path / "out"), {each.key: each for each in RECORDS})
    choose = """
        const [id, value] = given;
        const field = document.getElementById(id);
        field.value = value;
        field.dispatchEvent(new Event("input"));
        return [...document.querySelectorAll(".wall article")].filter((each) => each.offsetParent !== null)
            .map((each) => each.dataset.name + " " + each.dataset.profile);
    """
    with Browser(tmp_path / "chromium") as browser:
        browser.open((tmp_path / "out" / "index.html").as_uri())
        assert browser.run(choose, "order", "size") == ["b gles3", "b gles2-2048", "a gles3"]
        assert browser.run(choose, "order", "seconds") == ["a gles3", "b gles2-2048", "b gles3"]
        assert browser.run(choose, "name", "B") == ["b gles2-2048", "b gles3"]
        assert browser.run(choose, "result", "beyond") == ["b gles3"]
        assert browser.run(choose, "profile", "gles2-2048") == []
        assert browser.run("return document.getElementById('count').value") == "0 of 3"
        assert browser.console == []


def test_the_bar_of_a_terminal_shows_scans_bytes_failures_and_the_dashboard(capsys) -> None:
    shown = io.StringIO()
    with bar_on(Console(file=shown, force_terminal=True, width=120)) as bar:
        watcher = BatchWatcher(bar, as_json=False)
        watcher.dashboard("http://127.0.0.1:8787/status")
        watcher.begin(3)
        for each in (RECORDS[0], RECORDS[3]):
            task = SimpleNamespace(job=each)
            watcher.ended(TaskResult(task, each, is_new=True))
    text = shown.getvalue()
    assert "dashboard: http://127.0.0.1:8787/status" in text
    last = text[text.rindex("scans") :]
    for part in ("2/3", "1.0 kB", "1 failed"):
        assert part in last
    assert capsys.readouterr().out.splitlines()[0] == "a gles3: within, 3.0 s"


def test_without_a_terminal_there_is_no_bar_and_no_dashboard(capsys) -> None:
    with watching(as_json=False) as watcher:
        watcher.dashboard("http://127.0.0.1:8787/status")
        watcher.begin(3)
    assert capsys.readouterr() == ("", "")
