"""Packages with sub-volumes: the pieces are level 0, empty ones are not stored, and a box is cut out by seeking."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
import scene_builds
from phantom_scene import write_phantom_scene
from scene_builds import drawn, view_of

import volprep
from volprep.parts.subvolumes.cut_inputs import inputs_of_cut
from volprep.parts.subvolumes.cuts import boxes_zyx
from volprep.parts.subvolumes.decision import propose
from volprep.parts.subvolumes.piece import PieceVoxels
from volprep.pipeline.build import build
from volprep.pipeline.cut_files import write_cut
from volprep.render.cut import cut
from volprep.render.renderer import Renderer
from volprep.scene.profiles import load_profile
from volprep.scene.request import load_request, request_for_source
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.package.check import check
from volprep_formats.package.level_texels import level_texels
from volprep_formats.package.parts.subvolumes.record import SubvolumeGrid, decode_grid
from volprep_formats.package.reader import Package
from volprep_formats.package.storage import contents
from volprep_formats.package.storage.contents import open_contents
from volprep_formats.package.storage.files import names_in
from volprep_formats.package.storage.single_file import write_single_file
from volprep_formats.progress import Silent
from volprep_formats.textures import ktx2


def in_pieces(package):
    """Return the programs that draw sub-volumes."""
    return [program for program in package.manifest.programs if program.sampling == "subvolumes"]


def built(folder: Path, table: str, profile: str = "gles3", bits: int = 8) -> Package:
    scene = write_phantom_scene(folder, profile)
    text = scene.read_text(encoding="utf-8") + f"\n[quantize]\nbits = {bits}\n{table}"
    scene.write_text(text.replace('name = "phantom"', 'name = "phantom"\ncrop = "none"'), encoding="utf-8")
    return scene_builds.built(scene, folder / "phantom.volpkg")


def texels(package: Package, path: str) -> np.ndarray:
    return ktx2.decode(package.read_bytes(path), path).data


def grid_of(package: Package) -> SubvolumeGrid:
    name = package.manifest.subvolumes.grid
    return decode_grid(package.read_bytes(name), package.path, name)


@pytest.fixture(scope="module")
def package(tmp_path_factory) -> Package:
    return built(tmp_path_factory.mktemp("pieces"), '\n[grid]\nsize = 12\nlayout = "both"\n')


def test_the_pieces_are_level_0(package) -> None:
    assert check(package.path) == []
    whole = texels(package, "textures/volume-scan-0.ktx2")
    grid = grid_of(package)
    assert grid.counts_zyx == (2, 3, 4)
    for box, piece in zip(boxes_zyx(grid.cuts_zyx), grid.subvolumes, strict=True):
        # The window of the codes makes one code of all that no transfer function tells apart.
        stored = np.uint8(piece.minimum) if piece.file is None else texels(package, piece.file)
        np.testing.assert_array_equal(stored, whole[box])
        assert (piece.minimum, piece.maximum) == (whole[box].min(), whole[box].max())


def test_the_single_file_is_the_texture_of_level_0_where_there_is_one(package) -> None:
    assert package.manifest.subvolumes.whole == "textures/volume-scan-0.ktx2"
    assert grid_of(package).whole == "textures/volume-scan-0.ktx2"


def test_a_level_0_that_is_no_texture_gets_a_file_to_seek_in(tmp_path) -> None:
    profile = (Path(__file__).parents[2] / "volprep/scene/profiles/gles3.toml").read_text().replace("1024", "32")
    (tmp_path / "small.toml").write_text(profile)
    package = built(tmp_path, '\n[grid]\nsize = 12\nlayout = "single"\n', "small.toml")
    assert check(package.path) == []
    assert package.manifest.levels[0].index == 1
    assert package.manifest.subvolumes.pieces == ()
    assert texels(package, "subvolumes/whole.ktx2").shape == (21, 34, 45)


def test_pieces_have_a_table_where_each_coarser_level_has_its_own(tmp_path) -> None:
    profile = (Path(__file__).parents[2] / "volprep/scene/profiles/gles3.toml").read_text().replace("1024", "32")
    (tmp_path / "small.toml").write_text(profile)
    package = built(tmp_path, "\n[grid]\nsize = 12\n", "small.toml")
    assert check(package.path) == []
    grid, textures = package.manifest.grid, package.manifest.textures
    own = {(each.transfer, each.level) for each in textures if each.role == "transfer"}
    coarser = [level.index for level in package.manifest.levels]
    names = [each.name for each in package.manifest.transfer_functions]
    assert 0 not in coarser
    assert any(all((name, level) in own for level in coarser) for name in names)
    middle = len(grid_of(package).points) // 2
    view = view_of(grid, "left")
    pictures = []
    for name in names:
        with Renderer(package, point=middle, transfer=name) as renderer:
            pictures.append(renderer.render(view, (16, 16)))
    assert np.any(pictures)


@pytest.mark.long
def test_pieces_that_nobody_sees_are_not_stored(tmp_path) -> None:
    scene = write_phantom_scene(tmp_path)
    text = scene.read_text(encoding="utf-8").replace("value = 200.0", "value = 550.0")
    scene.write_text(text + "\n[grid]\nsize = 6\n", encoding="utf-8")
    package = scene_builds.built(scene, tmp_path / "phantom.volpkg")
    assert check(package.path) == []
    quantization = package.manifest.quantization
    low, high = quantization.window
    entry = (high - low) / (next(t for t in package.manifest.textures if t.role == "transfer").shape_zyx[2] - 1)
    pieces = grid_of(package).subvolumes
    for piece in pieces:
        largest = quantization.slope * piece.maximum + quantization.intercept
        # The filter of the lookup table reaches to the next entry.
        assert (piece.file is not None) == (largest > 550.0 - entry)
    assert 0 < sum(piece.file is not None for piece in pieces) < len(pieces)


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("layout", ["files", "single", "both"])
def test_a_cut_is_that_box_of_level_0(tmp_path, layout) -> None:
    package = built(tmp_path, f'\n[grid]\nsize = 9\nlayout = "{layout}"\n')
    whole = texels(package, "textures/volume-scan-0.ktx2")
    generator = np.random.default_rng(3)
    for _ in range(20):
        center = tuple(float(generator.integers(0, n)) for n in whole.shape[::-1])
        size = int(generator.integers(1, 50))
        found = cut(package, center, size)
        start, stop = found.record.start_zyx, found.record.stop_zyx
        box = tuple(slice(a, b) for a, b in zip(start, stop, strict=True))
        np.testing.assert_array_equal(found.texels, whole[box])
        for at, a, b, n in zip(center[::-1], start, stop, whole.shape, strict=True):
            assert b - a == min(size, n)
            assert a <= at < b
            # In the middle, unless the volume ends there.
            assert abs((a + b - 1) / 2 - at) <= 0.5 or a == 0 or b == n


@pytest.mark.parametrize("layout", ["files", "single"])
def test_a_cut_of_a_package_in_one_file_reads_the_same(tmp_path, layout) -> None:
    folder = built(tmp_path, f'\n[grid]\nsize = 9\nlayout = "{layout}"\n')
    target = tmp_path / "phantom.volpkg.zip"
    with target.open("wb") as file:
        write_single_file(folder.path, names_in(folder.path), file, Silent())
    expected, found = (cut(package, (20.0, 16.0, 10.0), 10) for package in (folder, Package.open(target)))
    np.testing.assert_array_equal(found.texels, expected.texels)
    assert found.record == expected.record


@pytest.mark.parametrize("layout", ["files", "single"])
def test_a_cut_reads_its_own_voxels_and_no_others(tmp_path, layout) -> None:
    package = built(tmp_path, f'\n[grid]\nsize = 9\nlayout = "{layout}"\n')
    record = cut(package, (20.0, 16.0, 10.0), 10).record
    assert record.texel_bytes_read == 10 * 10 * 10
    if layout == "single":
        # One read for each row, and one for the head of the file.
        assert (record.files_read, record.reads) == (1, 1 + 10 * 10)
    else:
        assert record.files_read <= 3**3
        assert record.reads <= record.files_read + 3 * 10 * 10
    everything = cut(package, (20.0, 16.0, 10.0), 100).record
    if layout == "single":
        assert (everything.texel_bytes_read, everything.reads) == (21 * 34 * 45, 2)
    else:
        assert everything.texel_bytes_read < 21 * 34 * 45
        assert everything.files_read + everything.empty_pieces == 3 * 5 * 6


@pytest.mark.long
@pytest.mark.parametrize(("profile", "dtype"), [("gles3", np.float16), ("gles3-norm16", np.uint16)])
def test_16_bit_pieces_hold_what_the_texture_holds(tmp_path, profile, dtype) -> None:
    package = built(tmp_path, "\n[grid]\nsize = 9\n", profile, bits=16)
    assert check(package.path) == []
    whole = texels(package, "textures/volume-scan-0.ktx2")
    assert whole.dtype == dtype
    found = cut(package, (20.0, 16.0, 10.0), 12)
    start, stop = found.record.start_zyx, found.record.stop_zyx
    np.testing.assert_array_equal(found.texels, whole[tuple(slice(a, b) for a, b in zip(start, stop, strict=True))])


def test_the_files_of_a_cut_say_where_it_lies(package, tmp_path) -> None:
    grid = package.manifest.grid
    world = grid.world_from_index @ [20.0, 16.0, 10.0, 1.0]
    write_cut(package, tuple(world[:3]), 12, tmp_path / "cut", world=True)
    record = json.loads((tmp_path / "cut" / "cut.json").read_text())
    texture = ktx2.decode((tmp_path / "cut" / "cut.ktx2").read_bytes(), "cut.ktx2")
    assert texture.shape_zyx == (12, 12, 12)
    assert record["start_zyx"] == [4, 10, 14]
    # The first voxel of the cut is where it was.
    np.testing.assert_allclose(record["grid"]["origin_mm_xyz"], (grid.world_from_index @ [14, 10, 4, 1])[:3])
    mark = next(mark for mark in record["marks"] if mark["level"] == 0)
    np.testing.assert_allclose(mark["low_str"], np.array([14, 10, 4]) / (45, 34, 21))
    assert (tmp_path / "cut" / "cut.png").stat().st_size > 100
    with pytest.raises(VolprepError, match="VP1251"):
        write_cut(package, tuple(world[:3]), 12, tmp_path / "cut", world=True)


def test_a_center_outside_the_volume_is_refused_with_its_size(package) -> None:
    with pytest.raises(VolprepError, match=r"VP4051.*20,16,21.*45 × 34 × 21"):
        cut(package, (20.0, 16.0, 21.0), 12)
    with pytest.raises(VolprepError, match="VP4051"):
        cut(package, (float("nan"), 16.0, 10.0), 12)


def test_a_package_without_pieces_cannot_be_cut(built_package) -> None:
    with pytest.raises(VolprepError, match="VP4050"):
        cut(Package.open(built_package), (0.0, 0.0, 0.0), 12)


def test_textures_are_checked_a_block_at_a_time(package, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(contents, "_BLOCK_BYTES", 5000)
    read_whole: list[str] = []
    read_bytes = Package.read_bytes
    monkeypatch.setattr(Package, "read_bytes", lambda self, path: read_whole.append(path) or read_bytes(self, path))
    assert check(package.path) == []
    assert not [path for path in read_whole if path.endswith(".ktx2")]
    zipped = tmp_path / "package.zip"
    with zipped.open("wb") as file:
        write_single_file(package.path, names_in(package.path), file, Silent())
    assert check(zipped) == []
    with open_contents(zipped, "textures/volume-scan-0.ktx2") as found:
        last = found.start_bytes + found.size_bytes - 1
    with zipped.open("r+b") as file:
        file.seek(last)
        (byte,) = file.read(1)
        file.seek(last)
        file.write(bytes([byte ^ 1]))
    assert [finding.code for finding in check(zipped)] == ["VP4061"]


def write_profile(folder: Path, **changes: int) -> str:
    """Write a profile as gles3 with other limits; return its name in a scene."""
    text = (Path(volprep.__file__).parent / "scene" / "profiles" / "gles3.toml").read_text(encoding="utf-8")
    for key, value in changes.items():
        # The second one says where the number comes from.
        text = re.sub(rf"^{key} = .*$", f"{key} = {value}", text, count=1, flags=re.MULTILINE)
    (folder / "small.toml").write_text(text, encoding="utf-8")
    return "small.toml"


def test_what_does_not_fit_is_cut_as_the_plan_proposes(tmp_path) -> None:
    profile = write_profile(tmp_path, max_3d_texture_size=24)
    whole = built(tmp_path, "", profile)
    assert whole.manifest.subvolumes is None
    (item,) = (item for item in whole.manifest.plan if item.name == "sub-volumes")
    size = int(re.search(r"size = (\d+)", item.reason)[1])
    request = load_request(tmp_path / "phantom.toml").with_grid("auto")
    build(request, tmp_path / "phantom.volpkg", Silent())
    package = Package.open(tmp_path / "phantom.volpkg")
    assert check(package.path) == []
    found = grid_of(package)
    assert found.size == size
    # Two pieces along each axis that is longer than a texture, nearly of one size.
    assert found.cuts_zyx == ((0, 20), (0, 22, 33), (0, 22, 44))
    assert found.counts_zyx == (1, 2, 2)


@pytest.mark.long
def test_what_fits_is_not_cut_and_what_cannot_be_cut_says_why(tmp_path) -> None:
    auto = '\n[grid]\nsize = "auto"\n'
    for profile, reason in (("gles3", "the whole volume fits into one texture"), ("gles1", "")):
        package = built(tmp_path, auto, profile)
        assert package.manifest.subvolumes is None
        assert [item.reason for item in package.manifest.plan if item.name == "sub-volumes"] == [reason] * bool(reason)
    package = built(tmp_path, auto, write_profile(tmp_path, max_3d_texture_size=24, max_texture_bytes=30_000))
    (item,) = (item for item in package.manifest.plan if item.name == "sub-volumes")
    assert not item.kept
    assert "pieces of 16 voxels along an axis are more than profile gles3 can hold" in item.reason


@pytest.mark.parametrize("edge", [16, 20, 64, 255, 256])
def test_a_proposal_is_the_fewest_pieces_in_half_of_the_memory(edge) -> None:
    limits = {"max_texture_bytes": 2 * 8 * edge**3, "max_3d_texture_size": 1024}
    profile = load_profile("gles3", Path()).model_copy(update=limits)
    grid = Grid.of((1000, 300, 40), (1.0, 1.0, 1.0))
    scene = request_for_source(Path("none.nrrd")).scene
    proposal = propose(scene, profile, grid, PieceVoxels(8))
    assert proposal.device_bytes <= 8 * edge**3
    assert proposal.size <= edge
    assert proposal.pieces_zyx[0] == -(-999 // (edge - 1))
    # One voxel less would need another piece.
    assert -(-999 // (proposal.size - 2)) > proposal.pieces_zyx[0]


def test_pieces_without_3d_textures_are_mosaics_of_one_layout(tmp_path) -> None:
    package = built(tmp_path, '\n[grid]\nsize = 12\nlayout = "both"\n', "gles2-2048")
    assert check(package.path) == []
    grid, whole = grid_of(package), level_texels(package, 0)
    np.testing.assert_array_equal(texels(package, grid.whole), whole)
    for number, (box, piece) in enumerate(zip(boxes_zyx(grid.cuts_zyx), grid.subvolumes, strict=True)):
        if piece.file is None:
            assert (whole[box] == piece.minimum).all()
        else:
            held = texels(package, piece.file)[0]
            np.testing.assert_array_equal(grid.voxels_of_mosaic(number, held), whole[box])
    # All eight units are for pieces.
    assert {each.classification for each in in_pieces(package)} == {"control-points"}
    assert {len(each.samplers) for each in in_pieces(package)} == {8}
    (item,) = (item for item in package.manifest.plan if item.name == "sub-volumes")
    assert "classified by the control points, since tables beside 8 pieces take more than the 8 units" in item.reason


def test_a_cut_out_of_mosaics_is_that_box_of_level_0(tmp_path) -> None:
    package = built(tmp_path, "\n[grid]\nsize = 9\n", "gles2-2048")
    found = cut(package, (20.0, 16.0, 10.0), 12)
    start, stop = found.record.start_zyx, found.record.stop_zyx
    box = tuple(slice(a, b) for a, b in zip(start, stop, strict=True))
    np.testing.assert_array_equal(found.texels, level_texels(package, 0)[box])
    # Twice a piece, less the shared layer, is what its program draws along an axis.
    assert drawn(package, "left", (8, 8), point=0, edit=inputs_of_cut(cut(package, (20.0, 16.0, 10.0), 15))).any()
    with pytest.raises(VolprepError, match=r"VP4052.*16×16×16 voxels.*9×8×8"):
        Renderer(package, point=0, edit=inputs_of_cut(cut(package, (20.0, 16.0, 10.0), 16)))


@pytest.mark.parametrize(
    ("tables", "profile", "reason"),
    [
        ('[render]\nclassification = "preintegrated"\n[grid]', "gles2-2048", "8 pieces and their table take 9 .* of 8"),
        ("[grid]\nsize = 60", "small.toml", "a piece has 15 slices of 38×31 voxels, .* 64×64 .* has room for 8"),
        ("[grid]", "gles1", "gles1"),
    ],
)
def test_a_profile_that_cannot_hold_pieces_says_why(tmp_path, tables, profile, reason) -> None:
    text = (Path(volprep.__file__).parent / "scene" / "profiles" / "gles2-2048.toml").read_text(encoding="utf-8")
    (tmp_path / "small.toml").write_text(text.replace("max_texture_size = 2048", "max_texture_size = 64"))
    scene = write_phantom_scene(tmp_path, profile, more=f"\n{tables}\n")
    with pytest.raises(VolprepError, match=f"VP3.*{reason}"):
        scene_builds.built(scene, tmp_path / "phantom.volpkg")


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (lambda grid: grid["cuts_zyx"][2].pop(), "cuts along x"),
        (lambda grid: grid["points"].pop(), "59 points instead of 60"),
        (lambda grid: grid["points"][0].update(subvolumes=[99]), "not there"),
        (lambda grid: grid.update(size=3), "cuts along z"),
        (lambda grid: grid.update(dimension="2d"), "2d, without a mosaic"),
    ],
)
def test_a_grid_that_contradicts_itself_is_refused(package, change, problem) -> None:
    record = json.loads(package.read_bytes(package.manifest.subvolumes.grid))
    change(record)
    with pytest.raises(VolprepError, match=f"VP4011.*{problem}"):
        decode_grid(json.dumps(record).encode(), package.path, "grid.json")


def test_the_same_scene_gives_the_same_pieces(package, tmp_path) -> None:
    again = built(tmp_path, '\n[grid]\nsize = 12\nlayout = "both"\n')
    assert [(file.path, file.sha256) for file in again.manifest.files] == [
        (file.path, file.sha256) for file in package.manifest.files
    ]
