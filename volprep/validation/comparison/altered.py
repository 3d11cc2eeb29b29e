"""A package in which some text files are others, for diagnostic pictures, and for other programs on its textures."""

from collections.abc import Callable, Mapping, Sequence

from volprep_formats.package.manifest import Manifest
from volprep_formats.package.picture import Drawing, Picture
from volprep_formats.package.program import PictureProgram
from volprep_formats.package.reader import Package

_TABLES = {"transfer", "preintegrated"}


class Altered(Package):
    """A package whose other files are its own."""

    def __init__(self, package: Package, texts: Mapping[str, str], program: PictureProgram | None = None) -> None:
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
    tables = manifest.textures_of(*_TABLES)
    common = {(texture.role, texture.transfer): texture.name for texture in tables if texture.level is None}
    others = {texture.name: common[texture.role, texture.transfer] for texture in tables if texture.level is not None}
    pictures = _with_textures(manifest.pictures, lambda drawing: [others.get(name, name) for name in drawing.textures])
    kept = tuple(texture for texture in manifest.textures if texture.name not in others)
    changed = manifest.model_copy(update={"textures": kept, "pictures": pictures})
    return Package(package.path, changed, package.channel)


def _with_program(manifest: Manifest, program: PictureProgram) -> Manifest:
    """Replace a program, and leave out textures of samplers that it does not have."""
    (before,) = (same for same in manifest.programs if same.name == program.name)

    def textures(drawing: Drawing) -> list[str]:
        if program.name != drawing.program:
            return list(drawing.textures)
        read = dict(zip(before.samplers, drawing.textures, strict=True))
        return [read[name] for name in program.samplers]

    programs = tuple(program if each.name == program.name else each for each in manifest.programs)
    pictures = _with_textures(manifest.pictures, textures)
    return manifest.model_copy(update={"programs": programs, "pictures": pictures})


def _with_textures(pictures: tuple[Picture, ...], textures: Callable[[Drawing], Sequence[str]]) -> tuple[Picture, ...]:
    return tuple(
        picture.model_copy(
            update={
                "drawings": tuple(
                    drawing.model_copy(update={"textures": tuple(textures(drawing))}) for drawing in picture.drawings
                )
            }
        )
        for picture in pictures
    )
