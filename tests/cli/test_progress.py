"""Progress on a stream that is no terminal, and in bars."""

from rich.progress import Progress as Bar

from volprep_cli.console import _Bars, _bars, _Lines, print_table

EVIL = "a\x1b[31m[bold]\nvolprep: all is well"


def test_a_task_that_starts_again_at_once_is_one_line(capsys) -> None:
    lines = _Lines()
    for task in ("import", "skip", "skip", "shaders"):
        lines.start(task, 3)
        lines.advance(3)
    lines.finish()
    assert [line.split(":")[0] for line in capsys.readouterr().err.splitlines()] == ["import", "skip", "shaders"]


def test_a_task_that_starts_again_at_once_is_one_bar() -> None:
    bar = Bar(disable=True)
    bars = _Bars(bar)
    for task in ("import", "skip", "skip", "shaders"):
        bars.start(task, 3)
        bars.advance(3)
    assert [(each.description, each.completed, each.total) for each in bar.tasks] == [
        ("import", 3, 3),
        ("skip", 6, 6),
        ("shaders", 3, 3),
    ]


def test_names_in_progress_and_headings_are_shown_as_they_are_and_in_one_line(capsys) -> None:
    lines = _Lines()
    lines.start(EVIL, 1)
    lines.finish()
    with _bars() as bars:
        bars.start(EVIL, 1)
    print_table((f"values ({EVIL})",), [(EVIL,)])
    told = capsys.readouterr()
    text = told.err + told.out
    assert text.count("a\\x1b[31m[bold]\\nvolprep: all is well") == 4
    assert "\nvolprep" not in text
