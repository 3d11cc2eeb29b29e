"""Normals in packages: kept where the scene asks, nowhere else; the same bytes however slabs are cut; odd volumes."""

from pathlib import Path

import numpy as np
import OpenImageIO
import pytest
import scene_builds
from judged import validate
from phantom_scene import write_phantom_scene
from scene_builds import view_of
from tiny_packages import function, tiny_package

from volprep.parts.mosaic.montage import write_montage
from volprep.render.renderer import Renderer
from volprep.scan import slabs
from volprep.scene import profiles
from volprep.scene.scene import NormalSettings
from volprep.truth.normal_codes import decoded
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.package.check import check
from volprep_formats.package.level_texels import level_texels
from volprep_formats.package.reader import Package
from volprep_formats.textures import ktx2

FOG = function((0.0, (0.2, 0.4, 0.8), 0.1), (255.0, (0.2, 0.4, 0.8), 0.1))


def built(folder: Path, tables: str, profile: str = "gles3") -> Path:
    scene = write_phantom_scene(folder, profile)
    text = scene.read_text(encoding="utf-8").replace("[pyramid]", f"{tables}\n[pyramid]")
    scene.write_text(text, encoding="utf-8")
    scene_builds.built(scene, folder / "p.volpkg")
    return folder / "p.volpkg"


LIT = '[quantize]\nbits = 8\n[render]\nlighting = "headlight"\n[normals]\n'


@pytest.fixture(scope="module")
def lit(tmp_path_factory) -> Path:
    return built(tmp_path_factory.mktemp("lit"), LIT)


def normals_of(package: Package, level: int = 0):
    texture = next(each for each in package.manifest.textures if (each.role, each.level) == ("normals", level))
    return texture, ktx2.decode(package.read_bytes(texture.file), texture.file).data


def item(package: Package, name: str):
    return next(each for each in package.manifest.plan if each.name == name)


def test_a_lit_scene_has_normals_of_every_level_and_a_program_that_reads_them(lit):
    package = Package.open(lit)
    manifest = package.manifest
    held = [texture for texture in manifest.textures if texture.role == "normals"]
    assert [texture.level for texture in held] == [level.index for level in manifest.levels]
    assert [texture.shape_zyx for texture in held] == [level.grid.shape_zyx for level in manifest.levels]
    assert all(program.lighting == "headlight" for program in manifest.programs)
    assert all(any("normals" in name for name in program.samplers) for program in manifest.programs)
    assert item(package, "normals").kept
    assert set(item(package, "normals").files) == {texture.file for texture in held}
    assert item(package, "normals").size_bytes == sum((lit / texture.file).stat().st_size for texture in held)


def test_without_light_nothing_of_normals_is_in_the_package(tmp_path):
    package = Package.open(built(tmp_path, ""))
    assert {texture.role for texture in package.manifest.textures} == {"volume", "transfer", "skip"}
    assert not item(package, "normals").kept
    assert "normal_at" not in package.read_text(package.manifest.level_programs[0].fragment)


@pytest.mark.long
def test_normals_can_be_data_for_an_app_with_a_light_of_its_own(tmp_path):
    package = Package.open(built(tmp_path, '[normals]\ncode = "oct12"\n'))
    texture, _ = normals_of(package)
    assert texture.filter == "nearest"
    assert "no shader reads them" in item(package, "normals").reason
    assert all(program.lighting == "none" for program in package.manifest.programs)
    validate(package.path, tmp_path / "report", picture_size=16)


def test_a_profile_without_3d_textures_has_mosaics_of_normals(tmp_path):
    package = Package.open(built(tmp_path, '[render]\nlighting = "headlight"\n', "gles2-2048"))
    manifest = package.manifest
    assert check(package.path) == []
    held = [texture for texture in manifest.textures if texture.role == "normals"]
    assert [texture.level for texture in held] == [level.index for level in manifest.levels]
    assert len(held) > 1
    for texture, level in zip(held, manifest.levels, strict=True):
        depth, height, width = level.grid.shape_zyx
        assert (texture.mosaic.slices, *texture.mosaic.tile_shape_yx) == (depth, height, width)
        assert (texture.dimension, texture.format, texture.mosaic.components_per_voxel) == ("2d", "rgb8unorm", 3)
    assert set(item(package, "normals").files) == {texture.file for texture in held}
    assert "as a mosaic of" in item(package, "normals").reason
    for level in manifest.levels:
        with Renderer(package, level=level.index) as renderer:
            view = view_of(manifest.grid, "anterior")
            assert renderer.render(view, (32, 32)).max() > 0


@pytest.mark.long
def test_normals_take_memory_of_mosaics(tmp_path):
    text = (Path(profiles.__file__).parent / "gles2-2048.toml").read_text(encoding="utf-8")
    (tmp_path / "small.toml").write_text(text.replace("67_108_864", "60_000"), encoding="utf-8")
    plain = Package.open(built(tmp_path, "", "small.toml")).manifest
    lit = built(tmp_path, '[render]\nlighting = "headlight"\n', "small.toml")
    # Of the 28 kB of level 0 three times more do not fit; its half does.
    assert (plain.levels[0].index, Package.open(lit).manifest.levels[0].index) == (0, 1)
    assert check(lit) == []


def test_normals_take_texture_units_of_mosaics(tmp_path):
    text = (Path(profiles.__file__).parent / "gles2-2048.toml").read_text(encoding="utf-8")
    (tmp_path / "few.toml").write_text(text.replace("units = 8", "units = 2"), encoding="utf-8")
    built(tmp_path, "", "few.toml")
    with pytest.raises(VolprepError, match=r"VP3022 .* its normals: the volume and its table take all 2 texture units"):
        built(tmp_path, "[normals]\n", "few.toml")


@pytest.mark.long
def test_a_skip_table_needs_a_texture_unit_that_normals_leave(tmp_path):
    text = (Path(profiles.__file__).parent / "gles2-2048.toml").read_text(encoding="utf-8")
    (tmp_path / "few.toml").write_text(text.replace("units = 8", "units = 3"), encoding="utf-8")
    tables = '[skip]\nkind = "distance"\n'
    plain = Package.open(built(tmp_path, tables, "few.toml"))
    assert item(plain, "skip table core").kept
    lit = Package.open(built(tmp_path, f'[render]\nlighting = "headlight"\n{tables}', "few.toml"))
    assert not item(lit, "skip table core").kept
    assert "leave no texture unit" in item(lit, "skip table core").reason


@pytest.mark.long
def test_mosaics_of_normals_are_the_same_however_slabs_are_cut(tmp_path, monkeypatch):
    wanted = "[normals]\n"
    (tmp_path / "again").mkdir()
    whole = Package.open(built(tmp_path, wanted, "gles2-2048"))
    monkeypatch.setattr(slabs, "SLAB_BYTES", 5000)
    again = Package.open(built(tmp_path / "again", wanted, "gles2-2048"))
    held = [texture for texture in whole.manifest.textures if texture.role == "normals"]
    assert len(held) > 1
    for texture in held:
        assert whole.read_bytes(texture.file) == again.read_bytes(texture.file)


def test_a_profile_without_the_format_of_a_code_says_which_it_has(tmp_path):
    text = (Path(profiles.__file__).parent / "gles3.toml").read_text(encoding="utf-8")
    (tmp_path / "old.toml").write_text(text.replace('"rgb8snorm", ', ""), encoding="utf-8")
    with pytest.raises(VolprepError, match="VP3050 normals of code snorm8 need textures of format rgb8snorm, but"):
        built(tmp_path, '[normals]\ncode = "snorm8"', "old.toml")


@pytest.mark.long
def test_normals_count_where_memory_is_short(tmp_path):
    text = (Path(profiles.__file__).parent / "gles3.toml").read_text(encoding="utf-8")
    (tmp_path / "small.toml").write_text(text.replace("268_435_456", "70_000"), encoding="utf-8")
    plain = Package.open(built(tmp_path, "", "small.toml")).manifest
    lit = Package.open(built(tmp_path, '[render]\nlighting = "headlight"', "small.toml")).manifest
    assert lit.levels[0].index > plain.levels[0].index


@pytest.mark.long
def test_the_same_bytes_come_out_however_slabs_are_cut(tmp_path, lit, monkeypatch):
    monkeypatch.setattr(slabs, "SLAB_BYTES", 5000)
    again = built(tmp_path, LIT)
    whole = Package.open(lit)
    for texture in whole.manifest.textures:
        assert whole.read_bytes(texture.file) == Package.open(again).read_bytes(texture.file)


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("profile", ["gles3", "gles2-2048"])
@pytest.mark.parametrize("code", ["biased8", "oct12"])
def test_normals_can_be_looked_at(tmp_path, profile, code):
    package = Package.open(built(tmp_path, f'[normals]\ncode = "{code}"\n', profile))
    write_montage(package, 0, tmp_path / "n.png", normals=True)
    colours = OpenImageIO.ImageInput.open(str(tmp_path / "n.png")).read_image("uint8")
    height, width = package.manifest.levels[0].grid.shape_zyx[1:]
    vectors = decoded(level_texels(package, 0, role="normals").view(np.uint8), code)
    # The first slice is at the top left.
    np.testing.assert_allclose(colours[:height, :width] / 127.5 - 1, vectors[0], rtol=0, atol=0.5 / 127.5 + 1e-9)
    with pytest.raises(VolprepError, match=r"VP1250 .* holds no level 9 with normals, only: 0, "):
        write_montage(package, 9, tmp_path / "n.png", normals=True)


@pytest.mark.parametrize("shape", [(1, 1, 1), (1, 7, 5), (9, 1, 1), (1, 1, 12)], ids=str)
@pytest.mark.parametrize("code", ["biased8", "oct8"])
def test_axes_of_one_voxel_have_no_slope(tmp_path, shape, code):
    codes = np.random.default_rng(1).integers(0, 256, shape, np.uint8)
    package = tiny_package(tmp_path / "p", codes, FOG, normals=NormalSettings(code=code))
    _, texels = normals_of(package)
    vectors = decoded(texels, code)
    thin = [axis for axis in range(3) if shape[axis] == 1]
    assert np.abs(vectors[..., [2 - axis for axis in thin]]).max() <= 1e-6
    assert np.isfinite(vectors).all()


@pytest.mark.parametrize("spacing", [(100.0, 1.0, 1.0), (1.0, 100.0, 1.0), (0.01, 0.5, 1.0)], ids=str)
def test_a_plane_has_its_normal_whatever_the_spacing(tmp_path, spacing):
    grid = Grid.of((8, 9, 10), spacing)
    normal = np.array([0.48, 0.6, 0.64])
    z, y, x = (np.arange(n) * h for n, h in zip(grid.shape_zyx, spacing, strict=True))
    field = x * normal[0] + y[:, None] * normal[1] + z[:, None, None] * normal[2]
    codes = np.rint(field / field.max() * 65535).astype(np.uint16)
    package = tiny_package(tmp_path / "p", codes, FOG, grid=grid, normals=NormalSettings(code="oct12"))
    vectors = decoded(normals_of(package)[1], "oct12")
    # Half a code at either end of a difference, on an axis along which the field rises by `rise` codes a voxel; and the
    # code's own 0.06°.
    rise = 65535 / field.max() * normal * np.array(spacing[::-1])
    expected = np.linalg.norm(0.5 * normal / rise) + np.radians(0.06)
    assert np.arccos(np.minimum(vectors @ normal, 1)).max() <= expected
