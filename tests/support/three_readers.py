"""The three readers of packages, Python, JavaScript and C, as programs that tell what they make of a file."""

from collections.abc import Sequence
from pathlib import Path

from command_line import ended
from compiled_c import SANITIZERS, compiled

from volprep_formats.package.check import check

_ROOT = Path(__file__).parents[2]
READ = "read"
"""What a reader says of a package that it takes."""


class Readers:
    """Reads many files with each reader; each process of C and JavaScript reads all of a batch."""

    def __init__(self, folder: Path) -> None:
        """Compile the C program into `folder`; a file on which it crashes is kept there as fuzz-case.zip."""
        self._folder = folder
        self._c = compiled(folder / "fuzz_volpkg", _ROOT / "tests" / "c" / "fuzz_volpkg.c", "-O1", *SANITIZERS)

    def python(self, path: Path) -> set[str]:
        """Codes of all that the Python reader finds wrong, or READ."""
        return {finding.code for finding in check(path, strict=False)} or {READ}

    def c(self, paths: Sequence[Path]) -> list[str]:
        """Code with which the C header refuses each file, or READ."""
        command = [self._c, "--try", *(path.resolve() for path in paths)]
        done = ended(command, cwd=self._folder)
        assert done.returncode == 0, done.stderr
        words = [line.split()[0] for line in done.stdout.splitlines()]
        return [READ if word == "0" else f"VP{word}" for word in words]

    def javascript(self, paths: Sequence[Path]) -> list[str]:
        """Code with which the modules of formats/js refuse each file, or READ."""
        script = _ROOT / "tests" / "readers" / "read_packages.mjs"
        listed = "".join(f"{path}\n" for path in paths)
        done = ended(["node", script], input=listed)
        assert done.returncode == 0, done.stderr
        return done.stdout.splitlines()

    def all(self, paths: Sequence[Path]) -> list[tuple[set[str], str, str]]:
        """What Python, C and JavaScript say of each file."""
        return list(zip(map(self.python, paths), self.c(paths), self.javascript(paths), strict=True))
