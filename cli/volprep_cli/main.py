"""The entry point: the list of verbs, and what becomes of an error."""

import os
import sys

import typer

from volprep_cli.doctor import doctor
from volprep_formats.diagnostics import VolprepError

app = typer.Typer(name="volprep", no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False)
app.command()(doctor)


@app.callback()
def volprep() -> None:
    """Turn a scan into a validated volume package for mobile GPUs."""


def main() -> None:
    """Run the command line. An error becomes one message on stderr and its exit status, never a traceback."""
    try:
        app()
    except VolprepError as error:
        _fail(error)
    except Exception as error:
        if os.environ.get("VOLPREP_TRACEBACK"):
            raise
        _fail(VolprepError("VP9001", error=f"{type(error).__name__}: {error}"))


def _fail(error: VolprepError) -> None:
    typer.echo(f"volprep: {error}", err=True)
    sys.exit(error.status)
