"""The committed typing stub of the native core is the one that its bindings give."""

import subprocess
import sys
from pathlib import Path

STUB = Path(__file__).parents[2] / "volprep" / "_native.pyi"


def test_the_stub_is_the_one_that_the_bindings_give(tmp_path):
    generated = tmp_path / STUB.name
    command = [sys.executable, "-m", "nanobind.stubgen", "-q", "-m", "volprep._native", "-o"]
    subprocess.run([*command, str(generated)], check=True)
    assert generated.read_text() == STUB.read_text(), f"write it anew: {' '.join([*command, str(STUB)])}"
