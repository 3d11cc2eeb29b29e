"""The entry point: the list of verbs, and what happens to errors."""

import gc
import os
import signal
import sys
from typing import Annotated, NoReturn

import typer

from volprep_cli.bricks import bricks
from volprep_cli.build import build
from volprep_cli.cut import cut
from volprep_cli.doctor import doctor
from volprep_cli.export import export
from volprep_cli.grid import grid
from volprep_cli.import_source import import_source
from volprep_cli.inspect import inspect
from volprep_cli.mosaic import mosaic
from volprep_cli.normals import normals
from volprep_cli.plan import plan
from volprep_cli.proxy import proxy
from volprep_cli.pyramid import pyramid
from volprep_cli.quantize import quantize
from volprep_cli.render import render
from volprep_cli.seal import seal
from volprep_cli.shaders import shaders
from volprep_cli.skip import skip
from volprep_cli.slices import slices
from volprep_cli.texture import texture
from volprep_cli.transfer import transfer
from volprep_cli.validate import validate
from volprep_formats.diagnostics import ExitStatus, VolprepError

_STATUSES = (
    "Exit statuses: 0 done; 1 a picture is further from the truth than the scene allows; 2 wrong command line; "
    "3 source; 4 scene or profile; 5 package; 6 output; 7 rendering; 8 something is missing on this machine; "
    "70 a defect in volprep; 130 interrupted. Every error has a permanent code: VP and four digits."
)

app = typer.Typer(
    name="volprep",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    # Plain help takes 0.1 s, with rich's markup it took 0.2 s.
    rich_markup_mode=None,
    epilog=_STATUSES,
)
app.command()(build)
app.command()(plan)
app.command()(inspect)
app.command()(render)
app.command()(validate)
app.command()(doctor)
app.command("import")(import_source)
app.command()(export)
app.command()(cut)
app.command()(quantize)
app.command()(pyramid)
app.command()(transfer)
app.command()(normals)
app.command()(mosaic)
app.command()(texture)
app.command()(bricks)
app.command()(skip)
app.command()(proxy)
app.command()(grid)
app.command()(slices)
app.command()(shaders)
app.command()(seal)


def _print_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version  # noqa: PLC0415 - keeps volprep --help fast

        print(f"volprep {version('volprep')}")
        raise typer.Exit


@app.callback()
def volprep(
    *,
    version: Annotated[
        bool, typer.Option("--version", help="Print the version.", is_eager=True, callback=_print_version)
    ] = False,
) -> None:
    """Turn a scan into a validated package for direct volume rendering on phones, tablets and the web."""


def main() -> None:
    """Run the command line. Whatever goes wrong becomes one message and a documented exit status."""
    # Both are read when the libraries load: the matrices here are small, and who else is installed is not our concern.
    # Together they took 0.1 s of the 0.5 s that an import needed to start.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    # Modules make no garbage when they load, and to look for it took 0.03 s; `progress` begins the search.
    gc.disable()
    # A reader that has seen enough, as head has, ends us without a word.
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    try:
        app(prog_name="volprep")
    except VolprepError as error:
        _fail(error)
    except Exception as error:
        if os.environ.get("VOLPREP_TRACEBACK") == "1":
            raise
        # Some messages have many lines, of which the first says what is wrong.
        text = (str(error).splitlines() or [""])[0]
        _fail(VolprepError("VP9001", error=f"{type(error).__name__}: {text}"))
    finally:
        gc.enable()
        # All goes with the process; to take it apart first took 0.04 s. OpenImageIO calls that leaks.
        if "OpenImageIO" not in sys.modules:
            gc.freeze()


def _fail(error: VolprepError) -> NoReturn:
    # A picture beyond the tolerance is a result, which is on stdout already.
    if "--json" in sys.argv and error.status is not ExitStatus.TOLERANCE:
        from volprep_cli.console import print_json  # noqa: PLC0415 - not needed when all is well

        print_json({"error": {"code": error.code, "summary": error.summary, "remedy": error.remedy}})
    print(f"volprep: {error}", file=sys.stderr)
    sys.exit(error.status)
