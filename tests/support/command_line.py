"""Running volprep as a person would: another process, its status, and what it prints."""

import os
import subprocess
import sys
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

from forked_commands import Forked

COMMAND = [sys.executable, "-c", "from volprep_cli.main import main; main()"]
_WITH_SMALL_PREVIEWS = """
import sys
sys.path.insert(0, sys.argv.pop(1))
from small_previews import small_previews
from volprep_cli.main import main
with small_previews():
    main()
"""
_TIMEOUT_S = 120.0


def volprep(*arguments: str | Path, cwd: Path | None = None, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run the command line. With an environment of its own it starts from nothing, as it does by `started`."""
    if environment:
        return started(*arguments, cwd=cwd, **environment)
    if _forked().serves(dict(os.environ)):
        return _forked().run([str(argument) for argument in arguments], cwd, _TIMEOUT_S)
    # A test has changed the environment of this process. Previews are as small as those of builds in the test.
    command = [sys.executable, "-c", _WITH_SMALL_PREVIEWS, str(Path(__file__).parent)]
    return _ended(command, arguments, cwd, {})


def started(*arguments: str | Path, cwd: Path | None = None, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run the command line in a process that starts from nothing, for tests of what a process does when it starts."""
    return _ended(COMMAND, arguments, cwd, environment)


def ended(words: Sequence[str | Path], *, timeout: float = 300, **options: Any) -> subprocess.CompletedProcess[str]:
    """Run a command to its end, whatever its status; options are those of `subprocess.run`."""
    return subprocess.run(words, capture_output=True, text=True, check=False, timeout=timeout, **options)


def _ended(
    command: list[str], arguments: tuple[str | Path, ...], cwd: Path | None, environment: dict[str, str]
) -> subprocess.CompletedProcess[str]:
    words = [*command, *(str(argument) for argument in arguments)]
    return ended(words, cwd=cwd, env={**os.environ, **environment}, timeout=_TIMEOUT_S)


@cache
def _forked() -> Forked:
    return Forked()
