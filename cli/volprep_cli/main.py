"""The entry point: the list of verbs, and error handling."""

import errno
import gc
import os
import signal
import sys
from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer

from volprep_cli.common import with_common_options
from volprep_cli.examples import EXAMPLES
from volprep_cli.streams import prepare_streams
from volprep_formats.diagnostics import ExitStatus, VolprepError

_STATUSES = (
    "Exit statuses: 0 done; 1 a picture is farther from the truth than the scene allows; 2 wrong command line; "
    "3 source; 4 scene or profile; 5 package; 6 output; 7 rendering; 8 something is missing on this machine; "
    "70 a defect in volprep; 130 interrupted. Every error has a permanent code: VP and four digits."
)

_HELP = {"help_option_names": ["-h", "--help"]}
_GO_ON = {
    "build": "; run the same command again, and it goes on after the last stage that was done",
    "batch": "; run the same command again, and it skips finished work",
}
"""Work that Ctrl-C loses, for verbs that can resume."""
_REFUSED = {errno.EACCES, errno.EPERM, errno.ELOOP, errno.ENAMETOOLONG, errno.EIO, errno.EMFILE, errno.ENFILE}
"""Errors of an operation that the system refuses: not defects of volprep."""
_INTERRUPTED = 130
"""Exit status that typer makes of Ctrl-C, and that a shell shows for a program which the signal ended."""

_VERBS = {
    "build": "build",
    "plan": "plan",
    "inspect": "inspect",
    "render": "render",
    "validate": "validate",
    "view": "view",
    "doctor": "doctor",
    "import": "import_source",
    "export": "export",
    "judge": "judge",
    "look": "look",
    "presets": "presets",
    "batch": "batch",
    "cut": "cut",
    "zip": "zip_package",
    "stage": "stage",
    "study": "study",
}
"""Module and function name of each verb."""
_GROUPS = ("stage", "study")
"""Verbs with verbs of their own, which the function `commands` of the module returns."""


def _print_version(wanted: bool) -> None:
    if wanted:
        from volprep_cli.version import version_text

        print(version_text())
        raise typer.Exit


def volprep(
    *,
    version: Annotated[
        bool, typer.Option("--version", help="Print the version.", is_eager=True, callback=_print_version)
    ] = False,
) -> None:
    """Turn a scan into a validated package for direct volume rendering on phones, tablets and the web.

    volprep look SCAN shows a scan. volprep build SCAN -o PACKAGE makes a package of it, and volprep build SCENE of a
    scene, a short text file that names a scan and describes its look. volprep view PACKAGE shows a package, and
    volprep validate PACKAGE proves it. volprep stage runs the stages of a build one by one, and volprep study measures
    more than a verdict does.
    """


def command_line(arguments: Sequence[str]) -> typer.Typer:
    """Return the program with the verb that the first argument names, or with all if it names none.

    To load the others, and to make their options, takes a tenth of a second.
    """
    program = typer.Typer(
        name="volprep",
        no_args_is_help=True,
        pretty_exceptions_enable=False,
        # Plain help takes 0.1 s, with rich's markup it took 0.2 s.
        rich_markup_mode=None,
        epilog=_STATUSES,
        context_settings=_HELP,
    )
    program.callback()(volprep)
    for verb in [verb for verb in arguments[:1] if verb in _VERBS] or _VERBS:
        module = import_module(f"volprep_cli.{_VERBS[verb]}")
        function = getattr(module, _VERBS[verb])
        if verb not in _GROUPS:
            program.command(verb, **_help(function, EXAMPLES[verb]))(with_common_options(function))
            continue
        group = typer.Typer(no_args_is_help=True, rich_markup_mode=None)
        group.callback()(function)
        program.add_typer(group, name=verb, **_help(function, EXAMPLES[verb]))
        for name, command in module.commands().items() if arguments[:1] == [verb] else ():
            group.command(name, **_help(command))(with_common_options(command))
    return program


def _help(function: Callable[..., None], examples: Sequence[str] = ()) -> dict[str, Any]:
    """Return the help of a verb. The list of verbs has the first paragraph whole; click would cut it off."""
    summary = " ".join((function.__doc__ or "").partition("\n\n")[0].split())
    # \b keeps click from filling the lines up.
    epilog = "\n".join(("\b", "Examples:", *(f"  {line}" for line in examples))) if examples else None
    return {"short_help": summary, "epilog": epilog, "context_settings": _HELP}


def main() -> None:
    """Run the command line. Every error becomes one message and a documented exit status."""
    has_output = prepare_streams()
    # Both are read when the libraries load: the matrices here are small, and who else is installed is not our concern.
    # Together they took 0.1 s of the 0.5 s that an import needed to start.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    # Modules make no garbage when they load, and to look for it took 0.03 s; `progress` begins the search.
    gc.disable()
    # A reader that has seen enough, as head has, ends us without a word.
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    try:
        try:
            _require_output(is_open=has_output)
            command_line(sys.argv[1:])(prog_name="volprep")
        finally:
            # Here, and not when the process ends: then it fails with nothing but a traceback.
            sys.stdout.flush()
    except VolprepError as error:
        _fail(error)
    except (SystemExit, KeyboardInterrupt) as ended:
        # Until the verb is loaded, nothing has converted it to an exit.
        if isinstance(ended, KeyboardInterrupt) or ended.code == _INTERRUPTED:
            _end_by_interrupt()
        raise
    except Exception as error:
        if isinstance(error, OSError) and (full := _no_room(error)) is not None:
            _drop_output()
            _fail(full)
        if isinstance(error, FileNotFoundError) and not _has_working_directory():
            _fail(VolprepError("VP7002"))
        if isinstance(error, OSError) and error.errno in _REFUSED:
            _fail(VolprepError("VP7003", path=error.filename or "this command", error=error.strerror))
        if os.environ.get("VOLPREP_TRACEBACK") == "1":
            raise
        if (limited := _beyond_limit(error)) is not None:
            _fail(limited)
        # Some messages have many lines; the first one describes the problem.
        text = (str(error).splitlines() or [""])[0]
        _fail(VolprepError("VP9001", error=f"{type(error).__name__}: {text}"))
    finally:
        gc.enable()
        # All goes with the process; to take it apart first took 0.04 s. OpenImageIO calls that leaks, and nanobind does
        # after an error: its traceback holds results of kernels.
        raised = sys.exc_info()[1]
        if "OpenImageIO" not in sys.modules and not (isinstance(raised, SystemExit) and raised.code):
            gc.freeze()


def _require_output(*, is_open: bool) -> None:
    """Raise VP7094 if a result in JSON would go to a closed stream."""
    if "--json" in sys.argv and not is_open:
        raise VolprepError("VP7094")


def _no_room(error: OSError) -> VolprepError | None:
    """Return the error for a full disk; None for another error. Most files have errors of their own."""
    from volprep_formats.output import NO_ROOM

    if error.errno not in NO_ROOM:
        return None
    import tempfile

    path = error.filename or f"a temporary file, perhaps in {tempfile.gettempdir()}"
    return VolprepError("VP4020", path=path, error=error.strerror)


def _has_working_directory() -> bool:
    try:
        Path.cwd()
    except FileNotFoundError:
        return False
    return True


def _beyond_limit(error: Exception) -> VolprepError | None:
    """Return the error for memory or threads that a limit of the address space refuses; None without a limit."""
    import resource

    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    refused = isinstance(error, MemoryError) or (isinstance(error, RuntimeError) and "new thread" in str(error))
    if not refused or limit == resource.RLIM_INFINITY:
        return None
    return VolprepError("VP7004", limit_mb=limit / 1e6, needed_mb=2 * limit / 1e6)


def _end_by_interrupt() -> None:
    """End as the signal of Ctrl-C ends a program: only then a shell stops the loop that the command runs in."""
    print(f"volprep: interrupted{_GO_ON.get(sys.argv[1] if len(sys.argv) > 1 else '', '')}", file=sys.stderr)
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    os.kill(os.getpid(), signal.SIGINT)


def _drop_output() -> None:
    """Discard the rest of standard output: text in a failed buffer would fail again at exit."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)


def _fail(error: VolprepError) -> NoReturn:
    # A picture beyond the tolerance is a result, which is on stdout already.
    if "--json" in sys.argv and error.status is not ExitStatus.TOLERANCE:
        from volprep_cli.console import print_json

        try:
            print_json({"error": {"code": error.code, "summary": error.summary, "remedy": error.remedy}})
            sys.stdout.flush()
        except OSError:
            _drop_output()
    print(f"volprep: {error}", file=sys.stderr)
    sys.exit(error.status)
