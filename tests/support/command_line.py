"""Running volprep as a person would: another process, its status, and what it prints."""

import os
import subprocess
import sys
from functools import cache
from pathlib import Path

from forked_commands import Forked

COMMAND = [sys.executable, "-c", "from volprep_cli.main import main; main()"]
_TIMEOUT_S = 120.0


def volprep(*arguments: str | Path, cwd: Path | None = None, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run the command line. With an environment of its own it starts from nothing, as it does by `started`."""
    if not environment and _forked().serves(dict(os.environ)):
        return _forked().run([str(argument) for argument in arguments], cwd, _TIMEOUT_S)
    return started(*arguments, cwd=cwd, **environment)


def started(*arguments: str | Path, cwd: Path | None = None, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run the command line in a process that starts from nothing, for tests of what a process does when it starts."""
    return subprocess.run(
        [*COMMAND, *(str(argument) for argument in arguments)],
        cwd=cwd,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
        timeout=_TIMEOUT_S,
    )


@cache
def _forked() -> Forked:
    return Forked()
