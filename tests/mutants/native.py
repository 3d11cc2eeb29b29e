"""Native cores with a bug, built from a copy of the sources; with ccache a build compiles one file."""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from threading import Lock

from .mutant import ROOT, Mutant

_SOURCES = ("CMakeLists.txt", "tools/cmake", "volprep/native")
_READERS = "add_subdirectory(formats/native)\n"
"""Left out: bugs are in the core alone, and the readers need OpenVDB."""


class NativeBuild:
    """Sources and objects in `folder`. One core is built at a time."""

    def __init__(self, folder: Path) -> None:
        """Copy the sources, and configure the build."""
        self._lock = Lock()
        self._source, self._build = folder / "source", folder / "build"
        shutil.rmtree(self._source, ignore_errors=True)
        for name in _SOURCES:
            copied = self._source / name
            copied.parent.mkdir(parents=True, exist_ok=True)
            (shutil.copytree if (ROOT / name).is_dir() else shutil.copy)(ROOT / name, copied)
        top = self._source / "CMakeLists.txt"
        top.write_text(top.read_text(encoding="utf-8").replace(_READERS, ""), encoding="utf-8")
        launcher = shutil.which("ccache")
        self._environment = {**os.environ, "CCACHE_BASEDIR": str(folder), "CCACHE_NOHASHDIR": "1"}
        self._run(
            *("cmake", "-S", str(self._source), "-B", str(self._build), "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release"),
            f"-DPython_EXECUTABLE={sys.executable}",
            *([f"-DCMAKE_CXX_COMPILER_LAUNCHER={launcher}"] if launcher else []),
        )

    def library(self, mutant: Mutant) -> Path:
        """Build the core with a bug, and return its library."""
        path = self._source / mutant.file
        with self._lock:
            before = path.read_text(encoding="utf-8")
            path.write_text(mutant.text(), encoding="utf-8")
            try:
                self._run("cmake", "--build", str(self._build), "--target", "_native")
            finally:
                path.write_text(before, encoding="utf-8")
            (built,) = (self._build / "volprep/native").glob("_native.*.so")
            kept = self._build / mutant.name / built.name
            kept.parent.mkdir(exist_ok=True)
            return Path(shutil.copy(built, kept))

    def _run(self, *command: str) -> None:
        path = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
        done = subprocess.run(
            command, env=self._environment | {"PATH": path}, capture_output=True, text=True, check=False
        )
        if done.returncode:
            raise RuntimeError(done.stdout[-2000:] + done.stderr[-2000:])
