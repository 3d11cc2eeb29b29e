"""Running volprep as a person would: another process, its status, and what it prints."""

import os
import subprocess
import sys
from pathlib import Path

COMMAND = [sys.executable, "-c", "from volprep_cli.main import main; main()"]


def volprep(*arguments: str | Path, cwd: Path | None = None, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run the command line."""
    return subprocess.run(
        [*COMMAND, *(str(argument) for argument in arguments)],
        cwd=cwd,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
