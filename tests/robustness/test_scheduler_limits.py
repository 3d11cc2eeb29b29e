"""Verbs under the hard limits of a scheduler: they work below a usual limit, and name one that is too low."""

import os
import resource
import subprocess
from pathlib import Path

import numpy as np
import pytest
from command_line import COMMAND, ended
from dicom_files import compressed, save_all, stack
from limits import require_addresses
from pydicom.uid import JPEG2000Lossless

from volprep_formats.diagnostics import ExitStatus

USUAL = {resource.RLIMIT_AS: 3 * 2**30, resource.RLIMIT_CPU: 200}
LOW = {resource.RLIMIT_AS: 400_000_000}


@pytest.fixture(scope="module")
def place(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("place")
    np.save(folder / "scan.npy", np.arange(8 * 9 * 10, dtype=np.int16).reshape(8, 9, 10))
    (folder / "series").mkdir()
    save_all([compressed(data, JPEG2000Lossless) for data in stack(5)], folder / "series", JPEG2000Lossless)
    return folder


def limited(place: Path, limits: dict[int, int], *words: str) -> subprocess.CompletedProcess[str]:
    def limit() -> None:
        for what, most in limits.items():
            resource.setrlimit(what, (most, most))

    return ended([*COMMAND, *words], cwd=place, env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}, preexec_fn=limit)


@pytest.mark.long
@pytest.mark.parametrize("scan", ["scan.npy", "series"])
def test_scans_are_built_and_validated_below_the_limits_of_a_scheduler(place, scan) -> None:
    built = limited(place, USUAL, "build", scan, "-o", f"{scan}.volpkg")
    assert built.returncode == ExitStatus.OK, built.stderr
    judged = limited(place, USUAL, "validate", f"{scan}.volpkg", "--size", "24")
    assert judged.returncode in {ExitStatus.OK, ExitStatus.TOLERANCE}, judged.stderr


def test_a_limit_of_memory_that_is_too_low_is_named(place) -> None:
    done = limited(place, LOW, "build", "scan.npy", "-o", "low.volpkg", "-q")
    assert done.returncode == ExitStatus.MACHINE
    assert done.stderr.startswith("volprep: VP7004 the limit of memory (ulimit -v), 400 MB, is too low")
    assert not (place / "low.volpkg").exists()


@pytest.mark.parametrize("soft", [2**34, resource.RLIM_INFINITY])
def test_tests_with_a_browser_are_skipped_only_below_a_hard_limit_of_addresses(monkeypatch, soft) -> None:
    monkeypatch.setattr(resource, "getrlimit", lambda _: (soft, resource.RLIM_INFINITY))
    require_addresses("Chromium")
    monkeypatch.setattr(resource, "getrlimit", lambda _: (soft, 2**34))
    with pytest.raises(pytest.skip.Exception, match="Chromium reserves terabytes of addresses, and ulimit -v allows"):
        require_addresses("Chromium")
