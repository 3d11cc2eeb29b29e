"""Runs a script of this folder in a process of its own.

VTK closes the EGL display that it shares with our renderer, and where a driver is missing it may end the process that
it runs in. In a process of its own both cost one message.
"""

import importlib.util
import os
import subprocess
import sys
from pathlib import Path
from typing import Literal

from volprep_formats.diagnostics import VolprepError
from volprep_formats.installation import how_to_add

Script = Literal["volume_pictures", "figure_pictures"]
"""A module of this folder. It gets the task's file and the result's file as arguments."""


_MODULES = ("pyvista", "vtkmodules")


def has_pyvista() -> bool:
    """Return whether pyvista and VTK are installed. Does not import them."""
    return all(importlib.util.find_spec(name) is not None for name in _MODULES)


def require_pyvista() -> None:
    """Raise VP6040 where pyvista, or VTK, is not installed. Does not import them."""
    for name in _MODULES:
        if importlib.util.find_spec(name) is None:
            raise VolprepError("VP6040", module=name, how=how_to_add("witness"))


def run_script(script: Script, task: Path, result: Path, *, seconds: float) -> None:
    """Run a script, which reads `task` and writes `result`.

    Raises VP6040 if pyvista is not installed, VP6041 if the script fails or takes longer than `seconds`.
    """
    require_pyvista()
    command = [sys.executable, "-m", f"{__package__}.{script}", str(task), str(result)]
    # VTK finds EGL by itself, but first warns about the missing X server.
    environment = {"VTK_DEFAULT_OPENGL_WINDOW": "vtkEGLRenderWindow"} if "DISPLAY" not in os.environ else {}
    try:
        done = subprocess.run(  # noqa: S603 - ourselves
            command,
            env=environment | os.environ,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            check=False,
            timeout=seconds,
        )
    except subprocess.TimeoutExpired:
        raise VolprepError("VP6041", problem=f"it was not ready after {seconds:g} s") from None
    except OSError as error:
        raise VolprepError("VP6041", problem=error.strerror or str(error)) from error
    if done.returncode or not result.is_file():
        raise VolprepError("VP6041", problem=_problem(done))


def _problem(done: "subprocess.CompletedProcess[str]") -> str:
    """Return the last line that the script has written to its error stream, or how it ended."""
    if done.returncode < 0:
        return f"its process was ended by signal {-done.returncode}"
    lines = [line.strip() for line in done.stderr.splitlines() if line.strip()]
    return lines[-1] if lines else f"its process ended with status {done.returncode}"
