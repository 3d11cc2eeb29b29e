"""A copy of the product made of links, in which single files are replaced. The checkout is never written to."""

import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path

from .mutant import ROOT, Mutant

_PACKAGES = {
    "volprep": "volprep",
    "formats/volprep_formats": "volprep_formats",
    "formats/js": "volprep_formats/js",
    "cli/volprep_cli": "volprep_cli",
}
"""Where each package is in the checkout, and in the copy."""
_NATIVE = ("volprep.kernels._native", "volprep_formats._vdb", "volprep_formats._dicom")
_WITHOUT_EDITABLE = """\
import sys

sys.meta_path[:] = [each for each in sys.meta_path if type(each).__name__ != "ScikitBuildRedirectingFinder"]
"""


class Overlay:
    """The copy in `folder`; `environment` makes Python import it."""

    def __init__(self, folder: Path) -> None:
        shutil.rmtree(folder, ignore_errors=True)
        self.folder = folder
        for origin, place in _PACKAGES.items():
            for path in (ROOT / origin).rglob("*"):
                inside = path.relative_to(ROOT / origin)
                if "__pycache__" in inside.parts or inside.parts[0] == "native" or path.is_dir():
                    continue
                target = folder / place / inside
                target.parent.mkdir(parents=True, exist_ok=True)
                target.symlink_to(path)
        for name in _NATIVE:
            self._copy(self._module(name, _installed(name)), _installed(name))
        (folder / "sitecustomize.py").write_text(_WITHOUT_EDITABLE, encoding="utf-8")

    @property
    def environment(self) -> dict[str, str]:
        """Environment variables that make Python import the copy."""
        own = {"PYTHONPATH": str(self.folder), "PYTHONSAFEPATH": "1", "PYTHONHASHSEED": "0"}
        return {**os.environ, **own}

    def plant(self, mutant: Mutant) -> None:
        """Put a bug into the copy; a native one is there already, as a library."""
        if not mutant.is_native:
            path = self._place(mutant.file)
            path.unlink()
            path.write_text(mutant.text(), encoding="utf-8")

    def mend(self, mutant: Mutant) -> None:
        """Take it out again."""
        if not mutant.is_native:
            self._replace(self._place(mutant.file), ROOT / mutant.file)

    def use_installed_core(self) -> None:
        """Take the native core of the installation."""
        self.use_core(_installed(_NATIVE[0]))

    def use_core(self, library: Path) -> None:
        """Take another native core. The build may have given it another suffix than the installation."""
        place = self._module(_NATIVE[0], library)
        for other in place.parent.glob(f"{_NATIVE[0].rpartition('.')[2]}.*.so"):
            other.unlink()
        self._copy(place, library)

    def run(self, *arguments: str, seconds: float, threads: int | None = None) -> subprocess.CompletedProcess[str]:
        """Run Python on the copy, with so many threads for each kind of work; all if None."""
        limits = {} if threads is None else {name: str(threads) for name in ("OMP_NUM_THREADS", "LP_NUM_THREADS")}
        return subprocess.run(
            [sys.executable, *arguments],
            cwd=ROOT,
            env=self.environment | limits,
            capture_output=True,
            text=True,
            timeout=seconds,
            check=False,
        )

    def _module(self, name: str, library: Path) -> Path:
        return self.folder / "/".join(name.split(".")[:-1]) / library.name

    def _place(self, file: str) -> Path:
        origin = next(each for each in _PACKAGES if file.startswith(f"{each}/"))
        return self.folder / _PACKAGES[origin] / Path(file).relative_to(origin)

    @staticmethod
    def _replace(link: Path, target: Path) -> None:
        link.unlink(missing_ok=True)
        link.symlink_to(target)

    @staticmethod
    def _copy(place: Path, library: Path) -> None:
        """Take a library as it is now: an installation may replace it while bugs are tried."""
        place.unlink(missing_ok=True)
        shutil.copy(library, place)


def _installed(module: str) -> Path:
    found = importlib.util.find_spec(module)
    assert found is not None, module
    assert found.origin is not None
    return Path(found.origin)
