"""A package in which some text files are others, for diagnostic pictures, and for other programs on its textures."""

from collections.abc import Mapping

from volprep_formats.package.manifest import Manifest
from volprep_formats.package.program import Program
from volprep_formats.package.reader import Package

_TABLES = {"transfer", "preintegrated"}


class Altered(Package):
    """A package whose other files are its own."""

    def __init__(self, package: Package, texts: Mapping[str, str], program: Program | None = None) -> None:
        """Replace the files named in `texts` by the texts, and the program of the same name by `program`."""
        manifest = package.manifest if program is None else _with_program(package.manifest, program)
        super().__init__(package.path, manifest, package.channel)
        self._package = package
        self._texts = texts

    def read_text(self, path: str) -> str:
        """Read a text file of the package, or the other text in its place."""
        return self._texts[path] if path in self._texts else self._package.read_text(path)


def with_common_tables(package: Package) -> Package:
    """Return the package in which no level has a table of its own."""
    manifest = package.manifest
    kept = tuple(each for each in manifest.textures if each.role not in _TABLES or each.level is None)
    return Package(package.path, manifest.model_copy(update={"textures": kept}), package.channel)


def _with_program(manifest: Manifest, program: Program) -> Manifest:
    changes: dict[str, object] = {"programs": _replaced(manifest.programs, program)}
    if manifest.proxy is not None:
        programs = _replaced(manifest.proxy.programs, program)
        changes["proxy"] = manifest.proxy.model_copy(update={"programs": programs})
    if manifest.subvolumes is not None:
        programs = _replaced(manifest.subvolumes.programs, program)
        changes["subvolumes"] = manifest.subvolumes.model_copy(update={"programs": programs})
    return manifest.model_copy(update=changes)


def _replaced(programs: tuple[Program, ...], program: Program) -> tuple[Program, ...]:
    return tuple(program if each.name == program.name else each for each in programs)
