"""Packages in one file of every kind, and the C programs that read them, each made once."""

import shutil
import subprocess
from pathlib import Path

import pytest
from command_line import ended
from compiled_c import SANITIZERS, compiled
from every_kind import write_every_kind

HEADER = Path(__file__).parents[2] / "formats" / "c" / "volpkg.h"
EXAMPLE = HEADER.with_name("example.c")


@pytest.fixture(scope="session")
def dump_program(tmp_path_factory) -> Path:
    """Prints what the header reads, under sanitizers."""
    source = Path(__file__).with_name("dump_volpkg.c")
    return compiled(tmp_path_factory.mktemp("dump") / "dump", source, *SANITIZERS)


@pytest.fixture(scope="session")
def fuzz_program(tmp_path_factory) -> Path:
    """Reads damaged packages, under sanitizers."""
    source = Path(__file__).with_name("fuzz_volpkg.c")
    return compiled(tmp_path_factory.mktemp("fuzz") / "fuzz", source, *SANITIZERS)


@pytest.fixture(scope="session")
def open_program(tmp_path_factory) -> Path:
    """Opens folders, zips and packages with Zstandard frames, under sanitizers."""
    tried = ["cc", "-x", "c", "-", "-o", "/dev/null", "-l:libzstd.so.1"]
    main = "int main(void) { return 0; }"
    if shutil.which("cc") is None or subprocess.run(tried, input=main.encode(), check=False).returncode:
        pytest.skip("there is no libzstd.so.1 to link to")
    source = Path(__file__).with_name("open_input.c")
    return compiled(tmp_path_factory.mktemp("open") / "open", source, *SANITIZERS, "-l:libzstd.so.1")


@pytest.fixture(scope="session")
def example_program(tmp_path_factory) -> Path:
    """The example, as its first lines say to compile it."""
    headers = [word for name in ("EGL/egl.h", "GLES/gl.h", "GLES3/gl3.h") for word in ("-include", name)]
    tried = ["cc", "-fsyntax-only", "-x", "c", *headers, "/dev/null"]
    if shutil.which("cc") is None or subprocess.run(tried, check=False, capture_output=True).returncode:
        pytest.skip("there are no headers of EGL and OpenGL ES (Debian: libegl-dev libgles-dev)")
    return compiled(tmp_path_factory.mktemp("example") / "example", EXAMPLE, "-lEGL", "-lGLESv1_CM", "-lGLESv2")


def told(program: Path, *arguments: Path | str) -> tuple[int, str]:
    """Run a program; give its exit status and all that it says."""
    done = ended([program, *arguments])
    return done.returncode, done.stdout + done.stderr


def output(program: Path, *arguments: Path | str) -> str:
    """Run a program that must succeed; give what it prints."""
    return subprocess.run([program, *arguments], check=True, capture_output=True, text=True).stdout


@pytest.fixture(scope="session")
def packages(tmp_path_factory) -> dict[str, Path]:
    """Packages in one file, by the name of their kind."""
    return write_every_kind(tmp_path_factory.mktemp("kinds"))
