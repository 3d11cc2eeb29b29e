"""Output of the verbs: results on stdout, progress and messages on stderr, optionally as JSON."""

import gc
import json
import re
import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from volprep_cli.streams import unescaped
from volprep_formats.shown import shown

if TYPE_CHECKING:
    from rich.progress import Progress as Bar
    from rich.progress import TaskID

    from volprep_formats.diagnostics import VolprepError
    from volprep_formats.package.manifest import Manifest
    from volprep_formats.progress import Progress

Json = Annotated[bool, typer.Option("--json", help="Print the result, or the error, as JSON.")]
"""The option --json of every verb."""

_HEARTBEAT_S = 10.0
_QUIET: ContextVar[bool] = ContextVar("quiet", default=False)
_AS_JSON: ContextVar[bool] = ContextVar("as_json", default=False)
_LONGEST_LINE = 10_000
_SURROGATE = re.compile("[\ud800-\udfff]")
"""Surrogates that represent, in Python, bytes that are not UTF-8 (PEP 383). JSON has no letter for them, and strict
parsers refuse them."""


def be_quiet(*, wanted: bool) -> None:
    """Turn off progress and notes, if `wanted`."""
    _QUIET.set(wanted)


def want_json(*, wanted: bool) -> None:
    """Make results and errors JSON, if `wanted`."""
    _AS_JSON.set(wanted)


def wants_json() -> bool:
    """Whether the option --json was given."""
    return _AS_JSON.get()


def print_done(text: str, **facts: object) -> None:
    """Print the result of a verb: the text, or its facts as JSON."""
    if wants_json():
        print_json(facts)
    else:
        print_line(text)


@contextmanager
def progress() -> Iterator["Progress"]:
    """Show progress on stderr: bars on a terminal, else a line for each task and every ten seconds."""
    # Objects loaded so far are not garbage; objects that the work creates may be.
    gc.freeze()
    gc.enable()
    try:
        if _QUIET.get():
            from volprep_formats.progress import Silent

            yield Silent()
        elif sys.stderr.isatty():
            with _bars() as bars:
                yield bars
        else:
            lines = _Lines()
            yield lines
            lines.finish()
    finally:
        gc.unfreeze()


@contextmanager
def _bars() -> Iterator["Progress"]:
    from rich.console import Console
    from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as Bar

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with Bar(*columns, console=Console(file=unescaped(sys.stderr))) as bar:
        yield _Bars(bar)


class _Lines:
    """Progress as lines of text. A task that starts again at once, as for the next channel, goes on."""

    def __init__(self) -> None:
        self._task = ""
        self._total = 0
        self._done = 0
        self._began = self._told = time.monotonic()

    def start(self, task: str, total: int) -> None:
        task = shown(task)
        if task == self._task:
            self._total += total
            return
        self.finish()
        self._task, self._total, self._done = task, total, 0
        self._began = self._told = time.monotonic()

    def advance(self, units: int = 1) -> None:
        self._done += units
        if time.monotonic() - self._told > _HEARTBEAT_S:
            self._told = time.monotonic()
            print(f"{self._task}: {self._done} of {self._total}", file=sys.stderr, flush=True)

    def finish(self) -> None:
        if self._task:
            print(f"{self._task}: {time.monotonic() - self._began:.1f} s", file=sys.stderr, flush=True)


class _Bars:
    """Progress as bars, one for each task. A task that starts again at once goes on in its bar."""

    def __init__(self, bar: "Bar") -> None:
        self._bar = bar
        self._task: TaskID | None = None
        self._name = ""
        self._total = 0

    def start(self, task: str, total: int) -> None:
        task = shown(task)
        if self._task is not None and task == self._name:
            self._total += total
            self._bar.update(self._task, total=self._total or None)
            return
        self._name, self._total = task, total
        self._task = self._bar.add_task(task, total=total or None)

    def advance(self, units: int = 1) -> None:
        if self._task is not None:
            self._bar.advance(self._task, units)


def print_remarks(manifest: "Manifest") -> None:
    """Print the remarks about a package to stderr."""
    from volprep.pipeline.remarks import remarks, warnings

    for text in remarks(manifest):
        print_note(text)
    print_warnings(warnings(manifest))


def print_warnings(texts: Iterable[str]) -> None:
    """Print warnings to stderr, also with --quiet."""
    for text in texts:
        _warn(f"warning: {text}")


def print_note(text: str) -> None:
    """Print a note to stderr, unless --quiet was given."""
    if not _QUIET.get():
        _warn(f"note: {text}")


def print_json(value: object) -> None:
    """Print JSON to stdout, keys sorted, in ASCII: independent of the encoding, and safe on terminals."""
    print(json.dumps(_unicode(value), indent=2, sort_keys=True))


def _unicode(value: object) -> object:
    """Return a value for JSON, with file-name bytes that are not UTF-8 as visible escapes."""
    if isinstance(value, str):
        return _SURROGATE.sub(lambda found: shown(found[0]), value)
    if isinstance(value, dict):
        return {key: _unicode(value) for key, value in value.items()}
    return [_unicode(member) for member in value] if isinstance(value, list | tuple) else value


def print_line(text: str) -> None:
    """Print one line of a result to stdout; it may contain untrusted text."""
    print(shown(text, _LONGEST_LINE))


def print_colours(text: str) -> None:
    """Print text to stdout with escape sequences for colours: untrusted text in it must be `shown`."""
    unescaped(sys.stdout).write(f"{text}\n")


def _warn(text: str) -> None:
    print(shown(text, _LONGEST_LINE), file=sys.stderr)


def end_beyond(error: "VolprepError") -> NoReturn:
    """Exit with `error`, which describes a result that was already printed."""
    if not wants_json():
        raise error
    # The report is complete; a second JSON document after it would break parsers.
    _warn(f"volprep: {error}")
    raise typer.Exit(error.status)


def print_table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print rows under headings; on a terminal long cells are folded to its width."""
    from rich.console import Console
    from rich.table import Column, Table

    columns = [Column(shown(heading), overflow="fold") for heading in headings]
    table = Table(*columns, box=None, pad_edge=False, header_style="bold")
    for row in rows:
        table.add_row(*(shown(cell, _LONGEST_LINE) for cell in row))
    # Piped text is for grep and diff: a row stays one line, and no line ends with blanks.
    console = Console(width=None if sys.stdout.isatty() else 10_000, highlight=False, markup=False)
    with console.capture() as captured:
        console.print(table)
    print_colours("\n".join(line.rstrip() for line in captured.get().splitlines()))


def voxels_text(numbers_zyx: Sequence[float]) -> str:
    """Format a shape for people, x first, as scanners and viewers do: 512×512×54."""
    return "×".join(f"{number:.6g}" for number in reversed(numbers_zyx))


def bytes_text(size: int) -> str:
    """Return a size for people: 512 B, 3.4 kB, 21.0 MB."""
    if size < 1000:
        return f"{size} B"
    return f"{size / 1000:.1f} kB" if size < 1_000_000 else f"{size / 1_000_000:.1f} MB"
