"""Progress on a stream that is no terminal, and in bars."""

from rich.progress import Progress as Bar

from volprep_cli.console import _Bars, _Lines


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
