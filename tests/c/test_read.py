"""What formats/c/volpkg.h gives of a package is what the Python reader gives, for every kind of package."""

import json
import subprocess
import zlib
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import ArrayLike

from volprep.render.block_inputs import block_inputs
from volprep.render.inputs import Inputs, level_inputs
from volprep.truth.camera import standard_views
from volprep_formats.meshes import Primitive, read_glb
from volprep_formats.package.channel_packages import package_of_transfer
from volprep_formats.package.parts.subvolumes.record import decode_grid
from volprep_formats.package.reader import Package
from volprep_formats.package.texture import Texture
from volprep_formats.textures import ktx2

from .conftest import told

NOT_KEPT = {"stages", "repairs"}
"""Lists of which the header keeps nothing."""
CAMERA = np.array([[2, 0, 0, 5], [0, 3, 0, 6], [0, 0, 4, 7], [0, 0, 0, 1]], float)
"""Box from clip of the drawings that the program prints."""


@pytest.fixture(scope="module")
def read(dump_program, packages) -> dict[str, tuple[dict, Package]]:
    """For each kind, what the header gives and what the reader does."""
    found = {}
    for kind, path in packages.items():
        printed = subprocess.run([dump_program, path], capture_output=True, check=True, text=True).stdout
        found[kind] = json.loads(printed), Package.open(path)
    return found


def differences(header: object, reader: object, path: str = "manifest") -> list[str]:
    """Where two records differ. A field that the reader says is absent may have any value that the header documents."""
    if isinstance(reader, dict) and isinstance(header, dict):
        keys = reader.keys() - NOT_KEPT
        lost = [f"{path}.{key} is missing" for key in keys - header.keys()]
        shared = [key for key in keys & header.keys() if reader[key] is not None]
        return lost + [each for key in shared for each in differences(header[key], reader[key], f"{path}.{key}")]
    if isinstance(reader, list) and isinstance(header, list) and len(reader) == len(header):
        pairs = enumerate(zip(header, reader, strict=True))
        return [each for n, (one, other) in pairs for each in differences(one, other, f"{path}[{n}]")]
    return [] if header == reader else [f"{path} is {header}, not {reader}"]


def test_every_field_of_every_record_is_what_the_reader_gives(read):
    for kind, (header, package) in read.items():
        assert differences(header["manifest"], package.manifest.model_dump(mode="json")) == [], kind


def texels_of(package: Package, texture: Texture) -> bytes:
    data = package.read_bytes(texture.file)
    if texture.format == "palette8-rgba8unorm":
        return data
    return ktx2.decode(data, texture.file).levels[texture.mipmap or 0].tobytes()


def test_texels_are_those_of_each_texture_and_mipmap(read):
    for kind, (header, package) in read.items():
        expected = {
            each.name: [len(texels), zlib.crc32(texels)]
            for each in package.manifest.textures
            for texels in [texels_of(package, each)]
        }
        assert header["texels"] == expected, kind


def test_shaders_are_the_files_of_the_package(read):
    for kind, (header, package) in read.items():
        expected = {each.fragment: zlib.crc32(package.read_bytes(each.fragment)) for each in package.manifest.programs}
        assert header["shaders"] == expected, kind


def part(primitive: Primitive) -> list[int]:
    positions, triangles = primitive.positions_xyz, primitive.triangles
    return [len(positions), triangles.size, zlib.crc32(positions.tobytes()), zlib.crc32(triangles.tobytes())]


def test_positions_and_triangles_of_meshes_are_those_of_the_reader(read):
    header, package = read["house"]
    assert package.manifest.proxy is not None
    expected = [
        [part(each) for each in read_glb(package.read_bytes(mesh.file), mesh.file).primitives]
        for mesh in package.manifest.proxy.meshes
    ]
    assert header["meshes"] == expected
    assert expected


@pytest.mark.parametrize("kind", ["house", "several-units"])
def test_the_grid_of_sub_volumes_is_the_readers(read, kind):
    header, package = read[kind]
    assert package.manifest.subvolumes is not None
    name = package.manifest.subvolumes.grid
    grid = decode_grid(package.read_bytes(name), package.path, name)
    assert differences(header["grid"], grid.model_dump(mode="json"), "grid") == []


def uniforms(inputs: Inputs, package: Package, level: int) -> dict[str, object]:
    """Value of each uniform of a level, column by column."""
    values = {"box_from_clip": CAMERA, "step_mm": inputs.step_mm, **inputs.values}
    return {
        each.name: pytest.approx(_by_columns(values[each.source]), rel=1e-6, abs=1e-9)
        for each in inputs.program.uniforms
        if each.source in values
    }


def _by_columns(value: ArrayLike) -> list[float]:
    array = np.asarray(value, np.float32)
    return (array.T if array.ndim == 2 else array).ravel().tolist()


def test_each_level_is_drawn_with_the_textures_and_uniforms_that_the_renderer_takes(read):
    for kind, (header, package) in read.items():
        drawn = [drawing for _, drawing in package.manifest.drawings if drawing.program is not None]
        assert len(header["drawings"]) == len(drawn), kind
        for drawing in header["drawings"]:
            shown = package_of_transfer(package, drawing["transfer"])
            inputs = level_inputs(shown, drawing["level"], drawing["transfer"])
            assert drawing["program"] == inputs.program.name
            assert [name for name, _, _ in drawing["textures"]] == [each.name for each in inputs.textures]
            expected = uniforms(inputs, package, drawing["level"])
            assert {name: drawing["uniforms"][name] for name in expected} == expected, kind


@pytest.mark.parametrize(("kind", "points"), [("house", 60), ("several-units", 24), ("segments", 24)])
def test_each_point_of_the_grid_is_drawn_with_the_pieces_and_uniforms_that_the_renderer_takes(read, kind, points):
    header, package = read[kind]
    assert len(header["points"]) == points
    for point, drawing in enumerate(header["points"]):
        inputs = block_inputs(package, point, None)
        assert drawing["uniforms"] == uniforms(inputs, package, 0)
        for (_, shape, crc32), texture in zip(drawing["textures"], inputs.textures, strict=True):
            texels = inputs.texels.get(texture.name)
            data = texels_of(package, texture) if texels is None else texels.tobytes()
            assert (tuple(shape), crc32) == (texture.shape_zyx, zlib.crc32(data))


def test_standard_views_are_the_cameras_of_the_renderer(read):
    projections = set()
    for kind, (header, package) in read.items():
        grid, render = package.manifest.grid, package.manifest.render
        assert grid is not None
        assert render is not None
        projections.add(render.projection)
        for name, camera in standard_views(grid, render.projection).items():
            expected = camera.box_from_clip(grid, 1.5)
            found = np.reshape(header["views"][name], (4, 4)).T
            # A camera's matrix is known up to a factor.
            assert np.allclose(found / found[3, 3], expected / expected[3, 3], rtol=1e-9, atol=1e-9), (kind, name)
    assert projections == {"orthographic", "perspective"}


def test_entries_of_lookup_tables_are_the_texels_as_numbers(read):
    for kind, (header, package) in read.items():
        for texture in (each for each in package.manifest.textures if each.role == "transfer"):
            texels = ktx2.decode(package.read_bytes(texture.file), texture.file).data[0, 0]
            expected = texels.astype(np.float64)
            if texture.max_extinction_per_mm is not None:
                expected /= 255
                expected[:, 3] = texture.max_extinction_per_mm * expected[:, 3] ** 2
            assert np.allclose(header["tables"][texture.name], expected, rtol=1e-7), kind


def test_a_file_that_is_no_package_is_refused_with_the_readers_code(dump_program, tmp_path: Path):
    (tmp_path / "p.zip").write_bytes(b"PK\x05\x06" + bytes(18))
    status, text = told(dump_program, tmp_path / "p.zip")
    assert status == 1
    assert "VP4002 manifest.json: the zip has none" in text
