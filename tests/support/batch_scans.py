"""Small scans for batches, and a batch that runs in a process of its own."""

import json
import os
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import nibabel
import numpy as np
import psutil
from command_line import COMMAND


def write_scans(folder: Path, count: int, *, edge: int = 12) -> list[Path]:
    """Write NIfTI files of different odd sizes, each in a folder of its own."""
    files = []
    for number in range(count):
        place = folder / f"place-{number}"
        place.mkdir(parents=True)
        z, y, x = np.indices((edge + number, edge - 1, edge + 1))
        values = np.hypot(np.hypot(z - edge / 2, y - edge / 3), x - edge / 2) * 100
        nibabel.save(nibabel.Nifti1Image(values.astype("<i2").T, np.diag([1.0, 1.0, 2.0, 1.0])), place / "scan.nii")
        files.append(place / "scan.nii")
    return files


def start(*arguments: str | Path, **environment: str) -> subprocess.Popen[str]:
    """Start volprep batch in a process group of its own."""
    return subprocess.Popen(
        [*COMMAND, "batch", *(str(argument) for argument in arguments)],
        env={**os.environ, "OMP_NUM_THREADS": "1", **environment},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def wait_until(holds: Callable[[], object], seconds: float = 60.0) -> None:
    """Wait until something holds."""
    ends = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < ends, "it did not come to hold"
        time.sleep(0.005)


def records(folder: Path) -> list[dict[str, object]]:
    """Read the lines of a ledger, whole ones only."""
    ledger = folder / "ledger.jsonl"
    text = ledger.read_text(encoding="ascii") if ledger.exists() else ""
    return [json.loads(line) for line in text.splitlines(keepends=True) if line.endswith("\n")]


def builders(process: subprocess.Popen[Any], folder: Path) -> list[psutil.Process]:
    """Return the processes of a batch that hold the lock of a job."""
    locks = {str(path) for path in (folder / ".batch").glob("*.*.lock")}
    found = []
    for child in psutil.Process(process.pid).children(recursive=True):
        try:
            if locks & {file.path for file in child.open_files()}:
                found.append(child)
        except psutil.Error:
            continue
    return found


def files_of(package: Path) -> dict[str, bytes]:
    """Return all files of a package with their bytes."""
    return {path.relative_to(package).as_posix(): path.read_bytes() for path in package.rglob("*") if path.is_file()}
