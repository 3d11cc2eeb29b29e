"""The native modules that are installed have what makes an overflow end the process. What they are is read from ELF."""

import platform
import re
import shutil
import subprocess
import sys
from functools import cache
from importlib.util import find_spec

import pytest

pytestmark = [
    pytest.mark.skipif(sys.platform != "linux", reason="ELF is Linux's"),
    pytest.mark.skipif(shutil.which("readelf") is None, reason="binutils is not installed"),
]

each_module = pytest.mark.parametrize(
    "module", ["volprep.kernels._native", "volprep_formats._dicom", "volprep_formats._vdb"]
)


@cache
def elf(module: str, *parts: str) -> str:
    """What readelf says of a module."""
    spec = find_spec(module)
    if spec is None:
        pytest.skip("this build has no OpenVDB")
    found = subprocess.run(["readelf", "--wide", *parts, spec.origin], check=True, capture_output=True, text=True)
    return found.stdout


def imported(module: str) -> set[str]:
    return set(re.findall(r" UND (\w+)", elf(module, "--dyn-syms")))


@each_module
def test_a_function_whose_stack_was_overwritten_does_not_return(module) -> None:
    assert "__stack_chk_fail" in imported(module)


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="only glibc checks copies")
@each_module
def test_copies_into_buffers_of_known_size_are_checked(module) -> None:
    assert {"__memcpy_chk", "__vsnprintf_chk"} <= imported(module)


@each_module
def test_the_table_of_functions_is_read_only_from_the_start(module) -> None:
    assert "GNU_RELRO" in elf(module, "--program-headers")
    assert re.search(r"\(FLAGS(_1)?\).*NOW", elf(module, "--dynamic")), "functions are bound later"


@each_module
def test_the_stack_is_not_executable(module) -> None:
    (rights,) = re.findall(r"GNU_STACK(?:\s+0x\w+){5}\s+([RWE]+)\s", elf(module, "--program-headers"))
    assert rights == "RW"
