"""The committed typing stubs of the native modules fit their bindings.

Those of the file formats are generated. That of the kernels is written by hand, because it is the place of their
documentation: its names, types and defaults are compared.
"""

import ast
import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
WITH_CONTRACT = re.compile(r"Annotated\[((?:[^\[\]]|\[[^\]]*\])*?), (?:dict\(.*?\)|'FixedSize', \d+)\]")
"""A type beside which the bindings say shape and order."""


def generated(module: str, folder: Path) -> tuple[str, list[str]]:
    """Return the stub that the bindings give, and the command that wrote it."""
    file = folder / "generated.pyi"
    command = [sys.executable, "-m", "nanobind.stubgen", "-q", "-m", module, "-o"]
    subprocess.run([*command, str(file)], check=True)
    return file.read_text(), command


@pytest.mark.parametrize(
    ("module", "stub"),
    [
        ("volprep_formats._dicom", ROOT / "formats" / "volprep_formats" / "_dicom.pyi"),
        ("volprep_formats._vdb", ROOT / "formats" / "volprep_formats" / "_vdb.pyi"),
    ],
)
def test_the_stub_is_the_one_that_the_bindings_give(tmp_path, module, stub):
    if module == "volprep_formats._vdb" and find_spec(module) is None:
        pytest.skip("this build has no OpenVDB")
    text, command = generated(module, tmp_path)
    assert text == stub.read_text(), f"write it anew: {' '.join([*command, str(stub)])}"


def test_the_stub_of_the_kernels_has_the_signatures_of_the_bindings(tmp_path):
    bound = signatures(generated("volprep.kernels._native", tmp_path)[0])
    written = signatures((ROOT / "volprep" / "kernels" / "_native.pyi").read_text())
    assert {name: signature for name, signature in written.items() if bound.get(name) != signature} == {}
    assert bound.keys() == written.keys()
    assert len(bound) > 60


def signatures(stub: str) -> dict[str, str]:
    """Return the signature of each function of a stub, and of each method with the name of its class."""
    found = {}
    for node in ast.parse(stub).body:
        inside = node.body if isinstance(node, ast.ClassDef) else [node]
        for function in inside:
            if isinstance(function, ast.FunctionDef):
                name = f"{node.name}.{function.name}" if node is not function else function.name
                found[name] = plain(f"({ast.unparse(function.args)}) -> {ast.unparse(function.returns)}")
    return found


def plain(signature: str) -> str:
    """Return a signature without contracts of arrays and names of modules; an array of any type is one of generic."""
    while (shorter := WITH_CONTRACT.sub(r"\1", signature)) != signature:
        signature = shorter
    signature = re.sub(r"\bNDArray\b(?!\[)", "NDArray[generic]", signature)
    return re.sub(r"\b(numpy\.typing|numpy|collections\.abc)\.", "", signature)
