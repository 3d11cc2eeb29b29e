"""The check of `volprep validate --quick`: whether a package is complete and agrees with itself, without OpenGL."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Self

from volprep_formats.diagnostics import VolprepError
from volprep_formats.meshes import read_glb
from volprep_formats.package.gate import disagreements, wrong_sizes
from volprep_formats.package.manifest import VERSION, FileRecord
from volprep_formats.package.parts.editing.record import decode_histogram
from volprep_formats.package.parts.proxy.mesh_file import mesh_problems
from volprep_formats.package.parts.proxy.record import ProxyMeshFile
from volprep_formats.package.parts.subvolumes.record import decode_grid
from volprep_formats.package.reader import Package
from volprep_formats.package.storage.contents import open_contents, sizes_of
from volprep_formats.package.storage.files import MANIFEST
from volprep_formats.package.texture import TEXTURE_ROLES, Texture
from volprep_formats.record import Record
from volprep_formats.textures import ktx2, paletted
from volprep_formats.textures.texel_formats import PALETTED
from volprep_formats.untrusted_json import parse_json, places_of_others

_MOST_PLACES = 10
"""Places of data of others that a warning names."""


class Finding(Record):
    """One thing that is wrong with a package."""

    code: str
    """Permanent code from the catalogue of diagnostics."""
    summary: str
    """Description of the problem."""
    remedy: str
    """Suggested remedy."""

    @classmethod
    def of(cls, error: VolprepError) -> Self:
        """Make a finding from `error`."""
        return cls(code=error.code, summary=error.summary, remedy=error.remedy)


def check(path: Path, *, strict: bool = True) -> list[Finding]:
    """Check schema, names, sizes, SHA-256, textures, files without a name, and all cross references.

    Return one finding for each thing that is wrong, none for a sound sealed package. If the manifest cannot be read,
    that is the only finding. Without `strict`, keys that this version does not know are ignored, as apps do.
    """
    try:
        package = Package.open_any(path, allow_draft=True, strict=strict)
    except VolprepError as error:
        return [Finding.of(error)]
    later = _later_version(package) if strict else ()
    return [Finding.of(error) for error in (*later, *_errors(package, strict=strict))]


def data_of_others(package: Package) -> tuple[str, ...]:
    """Return a warning for each JSON file of a package that has passed `check` and has `extras` or `extensions`."""
    with open_contents(package.path, MANIFEST) as contents:
        files = {MANIFEST: contents.read()}
    files |= {file.path: package.read_bytes(file.path) for file in package.manifest.files_of("grid")}
    found = {name: [*places_of_others(parse_json(data))] for name, data in files.items()}
    return tuple(
        f"{name} holds data of others, which nothing here has checked and which may name a patient: "
        f"{', '.join(places[:_MOST_PLACES])}{f' and {len(places) - _MOST_PLACES} more' * (len(places) > _MOST_PLACES)}"
        for name, places in found.items()
        if places
    )


def _later_version(package: Package) -> Iterator[VolprepError]:
    version, known = package.manifest.version, f"{VERSION[0]}.{VERSION[1]}"
    if version != known:
        yield VolprepError("VP4071", path=package.path, version=version, known=known)


def _errors(package: Package, *, strict: bool) -> Iterator[VolprepError]:
    path, manifest = package.path, package.manifest
    if manifest.state != "sealed":
        yield VolprepError("VP4005", path=path)
    sizes = sizes_of(path)
    yield from disagreements(path, manifest, sizes)
    if len({record.path for record in manifest.files}) < len(manifest.files):
        # Of two records of one file only the last one is compared below.
        yield from wrong_sizes(path, manifest, sizes)
    textures: dict[str, list[Texture]] = {}
    for texture in manifest.textures_of(*TEXTURE_ROLES):
        textures.setdefault(texture.file, []).append(texture)
    meshes = {mesh.file: mesh for mesh in (manifest.proxy.meshes if manifest.proxy else ()) if mesh.file is not None}
    for record in manifest.files:
        try:
            if record.path in textures:
                _check_texture(package, textures[record.path], record)
            elif record.path in meshes:
                _check_mesh(package, meshes[record.path], package.read_bytes(record.path))
            elif manifest.subvolumes is not None and record.path == manifest.subvolumes.grid:
                _check_grid(package, record.path, package.read_bytes(record.path), strict=strict)
            else:
                _CHECKS.get(record.role, _check_start)(package, record)
        except VolprepError as error:
            yield error


def _head(package: Package, record: FileRecord) -> ktx2.Ktx2Head:
    """Compare the digest of a texture, which may be as large as the scan, and read the bytes before its texels."""
    data = package.read_start(record.path, ktx2.MOST_HEAD_BYTES)
    head = ktx2.decode_head(data, record.size_bytes, f"{package.path}: {record.path}")
    cut_from = package.manifest.subvolumes and package.manifest.subvolumes.whole
    if head.supercompressed and record.path == cut_from:
        problem = f"{record.path} is supercompressed, so that no box can be cut from it"
        raise VolprepError("VP4011", path=package.path, problem=problem)
    return head


def _check_start(package: Package, record: FileRecord) -> None:
    package.read_start(record.path, 0)


def _check_histogram(package: Package, record: FileRecord) -> None:
    decode_histogram(package.read_bytes(record.path), f"{package.path}: {record.path}")


_CHECKS: dict[str, Callable[[Package, FileRecord], object]] = {
    "subvolume": _head,
    "shader": lambda package, record: package.read_text(record.path),
    "histogram": _check_histogram,
}
"""Checks of files that are no textures of the manifest, by role."""


def _check_mesh(package: Package, record: ProxyMeshFile, data: bytes) -> None:
    level = next((level for level in package.manifest.levels if level.index == record.level), None)
    mesh = read_glb(data, f"{package.path}: {record.file}")
    for problem in mesh_problems(record, mesh, level.grid.shape_zyx) if level else ():
        raise VolprepError("VP4011", path=package.path, problem=f"{record.file} {problem}")


def _check_grid(package: Package, name: str, data: bytes, *, strict: bool) -> None:
    is_known = package.manifest.version == f"{VERSION[0]}.{VERSION[1]}"
    grid, files = decode_grid(data, package.path, name, strict=strict and is_known), package.manifest.subvolumes
    pieces = tuple(piece.file for piece in grid.subvolumes if piece.file is not None)
    if files is None or (files.pieces, files.whole) != (pieces, grid.whole):
        raise VolprepError("VP4011", path=package.path, problem=f"{name} names other files than the manifest")
    level = package.manifest.grid
    if level is None or level.shape_zyx != grid.shape_zyx:
        raise VolprepError("VP4011", path=package.path, problem=f"{name} is not cut from the grid of level 0")
    for number, piece in enumerate(grid.subvolumes):
        record = next((listed for listed in package.manifest.files if listed.path == piece.file), None)
        if record is not None:
            start = package.read_part(record.path, 0, ktx2.MOST_HEAD_BYTES)
            head = ktx2.decode_head(start, record.size_bytes, f"{package.path}: {record.path}")
            expected = (grid.texture_format, grid.texture_shape_zyx(number), grid.dimension, 1)
            if (head.format, head.shape_zyx, f"{head.dimensions}d", len(head.levels_at)) != expected:
                problem = f"{piece.file} is not the texture that {name} says"
                raise VolprepError("VP4011", path=package.path, problem=problem)


def _check_texture(package: Package, textures: list[Texture], record: FileRecord) -> None:
    """Check a file that holds one texture, or one for each of its mipmaps."""
    path = package.path
    if textures[0].format == PALETTED:
        paletted.decode(package.read_bytes(record.path), textures[0].shape_zyx[1:], f"{path}: {record.path}")
        return
    head = _head(package, record)
    mipmaps = [texture.mipmap or 0 for texture in textures]
    if sorted(mipmaps) != list(range(len(head.levels_at))):
        problem = f"{record.path} holds {len(head.levels_at)} mipmaps, its textures are mipmaps {mipmaps}"
        raise VolprepError("VP4011", path=path, problem=problem)
    for texture, mipmap in zip(textures, mipmaps, strict=True):
        found = (head.format, ktx2.mipmap_shape(head.shape_zyx, mipmap), f"{head.dimensions}d")
        expected = (texture.format, texture.shape_zyx, texture.dimension)
        if found != expected:
            problem = f"{record.path} holds {found}, the manifest says {expected}"
            raise VolprepError("VP4011", path=path, problem=problem)
