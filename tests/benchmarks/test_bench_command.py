"""`make bench` where there are no real scans."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def bench(*words: str) -> subprocess.CompletedProcess[str]:
    pytest.importorskip("tinybrain", reason="the benchmarks' peers are not installed: make bench")
    command = [sys.executable, "-m", "tests.benchmarks", *words]
    environment = {**os.environ, "VOLPREP_TEST_DATA": ""}
    return subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)


@pytest.mark.long
def test_what_needs_a_scan_is_left_out_with_the_reason():
    run = bench("leaving", "import")
    assert run.returncode == 0, run.stderr
    missing = "not measured: VOLPREP_TEST_DATA names no folder of real scans"
    assert run.stdout.splitlines() == [f"import: {missing}", f"leaving out: {missing}", "Nothing was measured."]


@pytest.mark.long
def test_an_unknown_name_is_an_error_that_lists_the_known_ones():
    run = bench("nonsense")
    assert run.returncode == 1
    assert "kernels, import, decode" in run.stderr
