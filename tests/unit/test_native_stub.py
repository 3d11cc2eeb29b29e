"""The committed typing stubs of the native modules are the ones that their bindings give."""

import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(
    ("module", "stub"),
    [
        ("volprep.kernels._native", ROOT / "volprep" / "kernels" / "_native.pyi"),
        ("volprep_formats._dicom", ROOT / "formats" / "volprep_formats" / "_dicom.pyi"),
        ("volprep_formats._vdb", ROOT / "formats" / "volprep_formats" / "_vdb.pyi"),
    ],
)
def test_the_stub_is_the_one_that_the_bindings_give(tmp_path, module, stub):
    if module == "volprep_formats._vdb" and find_spec(module) is None:
        pytest.skip("this build has no OpenVDB")
    generated = tmp_path / stub.name
    command = [sys.executable, "-m", "nanobind.stubgen", "-q", "-m", module, "-o"]
    subprocess.run([*command, str(generated)], check=True)
    assert generated.read_text() == stub.read_text(), f"write it anew: {' '.join([*command, str(stub)])}"
