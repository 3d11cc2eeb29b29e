"""Pictures with and without empty-space skipping are the same: jumps end where rays leave, samples stay in place."""

import re

import numpy as np
import pytest
from blobs import DIRECTIONS, SHELLS, blobs, check_same
from scene_builds import drawn
from tiny_packages import ES2, ES3, function, tiny_package

from volprep.parts.mosaic.packing import Packing
from volprep.render.renderer import Renderer
from volprep.truth.camera import Camera, standard_views
from volprep_formats.grid import Grid
from volprep_formats.textures import ktx2

KINDS = ["blocks", "table16", "distance"]
profiles = pytest.mark.parametrize("profile", [ES3, ES2], ids=["texture3d", "mosaic"])


def pictures(folder, codes, profile, views, projection, *, target="rgba32f", **wishes):
    package = tiny_package(folder, codes, SHELLS, profile, **wishes)
    grid = package.manifest.levels[0].grid
    cameras = standard_views(grid, projection)
    found = []
    for level in range(1 if isinstance(codes, np.ndarray) else len(codes)):
        with Renderer(package, level=level, target=target) as renderer:
            found += [renderer.render(cameras[view].box_from_clip(grid, 1.25), (60, 75)) for view in views]
    return np.stack(found), package


@pytest.mark.long(keep=4)
@profiles
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_skipping_changes_no_pixel(tmp_path, profile, kind, projection):
    seed = KINDS.index(kind)
    direction = list(DIRECTIONS.values())[seed % 3]
    shape, spacing = ((37, 41, 53), (2.0, 0.7, 1.1)) if projection == "perspective" else ((45, 33, 29), (0.8, 1.3, 0.9))
    codes = blobs(seed, shape)
    grid = Grid.of(shape, spacing, (4.0, -9.0, 2.0), direction)
    views = ("anterior", "superior", "left", "anterior-right", "posterior-left")
    plain, _ = pictures(tmp_path / "plain", codes, profile, views, projection, grid=grid)
    block = 3 if kind == "table16" else (8, 4, 5)[seed % 3]
    skipping, package = pictures(
        tmp_path / "skipping", codes, profile, views, projection, grid=grid, skip=(kind, block)
    )
    assert package.manifest.skipping.tables[0].empty_share > 0.3
    assert plain[..., 3].max() > 0.5
    check_same(skipping, plain)


@pytest.mark.long(keep=1)
@profiles
@pytest.mark.parametrize("block", [1, 4, 7])
def test_skipping_changes_no_pixel_of_labels(tmp_path, profile, block):
    codes = blobs(5, (40, 37, 31))
    views = ("right", "anterior-left")
    wishes = {"labels": True, "spacing_mm_zyx": (0.8, 1.3, 0.9)}
    plain, _ = pictures(tmp_path / "plain", codes, profile, views, "orthographic", **wishes)
    skipping, _ = pictures(
        tmp_path / "skipping", codes, profile, views, "orthographic", skip=("distance", block), **wishes
    )
    check_same(skipping, plain)


@pytest.mark.parametrize("block", [1, 2, 7, 16, 64])
def test_blocks_of_any_size_change_no_pixel(tmp_path, block):
    codes = blobs(11, (40, 37, 31))
    views = ("right", "anterior-left")
    plain, _ = pictures(tmp_path / "plain", codes, ES3, views, "orthographic")
    skipping, _ = pictures(tmp_path / "skipping", codes, ES3, views, "orthographic", skip=("distance", block))
    check_same(skipping, plain)


@pytest.mark.parametrize("step_mm", [0.07, 1.9, 11.0])
def test_samples_of_any_distance_stay_where_they_are(tmp_path, step_mm):
    codes = blobs(12, (40, 37, 31))
    views = ("inferior", "posterior-left")
    plain, _ = pictures(tmp_path / "plain", codes, ES3, views, "perspective", step_mm=step_mm)
    skipping, _ = pictures(
        tmp_path / "skipping", codes, ES3, views, "perspective", step_mm=step_mm, skip=("distance", 8)
    )
    check_same(skipping, plain)


def test_every_level_has_a_table_of_its_own(tmp_path):
    finest = blobs(13, (40, 48, 32))
    coarse = np.ascontiguousarray(finest.reshape(20, 2, 24, 2, 16, 2).mean(axis=(1, 3, 5)).round().astype(np.uint8))
    views = ("anterior-left", "left")
    plain, _ = pictures(tmp_path / "plain", [finest, coarse], ES3, views, "orthographic")
    skipping, package = pictures(
        tmp_path / "skipping", [finest, coarse], ES3, views, "orthographic", skip=("distance", 4)
    )
    assert [table.blocks_zyx for table in package.manifest.skipping.tables] == [(10, 12, 8), (5, 6, 4)]
    check_same(skipping, plain)


def test_half_floats_are_measured_as_they_are_sampled(tmp_path):
    codes = blobs(14, (31, 30, 29), bits=16)
    views = ("anterior-left", "superior")
    plain, _ = pictures(tmp_path / "plain", codes, ES3, views, "orthographic", entries=1024)
    skipping, _ = pictures(tmp_path / "skipping", codes, ES3, views, "orthographic", entries=1024, skip=("distance", 4))
    check_same(skipping, plain)


@profiles
@pytest.mark.parametrize("kind", ["distance", "table16"])
def test_pre_integrated_segments_are_skipped_only_where_both_ends_are_empty(tmp_path, profile, kind):
    codes = blobs(15, (37, 41, 33))
    views = ("anterior", "anterior-right", "posterior-left")
    wishes = {"classification": "preintegrated", "step_mm": 1.3, "entries": 64}
    plain, _ = pictures(tmp_path / "plain", codes, profile, views, "perspective", **wishes)
    skipping, package = pictures(tmp_path / "skipping", codes, profile, views, "perspective", skip=(kind, 6), **wishes)
    assert (
        "front = end_at" in package.read_text(package.manifest.level_programs[0].fragment).split("skip_entry(block")[1]
    )
    check_same(skipping, plain)


@profiles
def test_an_eye_inside_the_volume_skips_from_where_it_is(tmp_path, profile):
    shape = (40, 40, 40)
    grid = Grid.of(shape, (1.0, 1.0, 1.0))
    camera = Camera((17.3, 20.1, 18.2), (1.0, 0.3, -0.2), (0.0, 0.0, 1.0), 30.0, 40.0, "perspective")
    found = []
    for name, skip in (("plain", None), ("skipping", ("distance", 4))):
        package = tiny_package(tmp_path / name, blobs(16, shape), SHELLS, profile, skip=skip, cutoff=0.99)
        with Renderer(package, target="rgba32f") as renderer:
            found.append(renderer.render(camera.box_from_clip(grid, 1.0), (64, 64)))
    assert found[0][..., 3].max() > 0.5
    check_same(*found)


@profiles
def test_a_transfer_function_that_shows_nothing_gives_an_empty_picture(tmp_path, profile):
    nothing = function((0.0, (1.0, 1.0, 1.0), 0.0))
    package = tiny_package(tmp_path / "p", blobs(17, (20, 21, 22)), nothing, profile, skip=("distance", 4))
    assert not drawn(package, "left", (20, 20)).any()


def test_one_voxel_and_one_slice_can_be_skipped_too(tmp_path):
    for number, shape in enumerate([(1, 1, 1), (1, 40, 30), (50, 1, 2)]):
        codes = blobs(18 + number, shape)
        views = ("anterior-left",)
        plain, _ = pictures(tmp_path / f"p{number}", codes, ES3, views, "orthographic")
        skipping, _ = pictures(tmp_path / f"s{number}", codes, ES3, views, "orthographic", skip=("distance", 8))
        check_same(skipping, plain)


@profiles
@pytest.mark.parametrize("kind", KINDS)
def test_uniforms_and_samplers_of_a_skipping_shader_are_all_active(tmp_path, profile, kind):
    # The renderer refuses a program whose active uniforms are not exactly those that the manifest names.
    package = tiny_package(tmp_path / "p", blobs(20, (9, 10, 11)), SHELLS, profile, skip=(kind, 4))
    with Renderer(package) as renderer:
        assert "u_skip" in renderer.program.samplers
    text = re.sub(r"//.*", "", package.read_text(package.manifest.level_programs[0].fragment))
    names = re.findall(r"^(?:float|vec[234]) (\w+)\(|^const \w+ (\w+)", text, re.MULTILINE)
    for name in map("".join, names):
        assert len(re.findall(rf"\b{name}\b", text)) > 1, f"{name} is dead"


def test_without_a_table_no_shader_knows_of_skipping(tmp_path):
    package = tiny_package(tmp_path / "p", blobs(20, (9, 10, 11)), SHELLS)
    text = package.read_text(package.manifest.level_programs[0].fragment)
    assert "skip" not in text
    assert "next" not in text
    assert "block" not in text


@pytest.mark.parametrize("kind", ["distance", "blocks"])
def test_a_mosaic_holds_the_table_that_a_3d_texture_holds(tmp_path, kind):
    tables = []
    for name, profile in (("es2", ES2), ("es3", ES3)):
        package = tiny_package(tmp_path / name, blobs(21, (37, 30, 41)), SHELLS, profile, skip=(kind, 5))
        texture = next(each for each in package.manifest.textures if each.role == "skip")
        data = ktx2.decode(package.read_bytes(texture.file), texture.file).data
        if texture.mosaic is not None:
            layout = texture.mosaic
            height, width = layout.tile_shape_yx
            data = np.stack(
                [
                    data[0, (k // layout.tiles_x) * height :, (k % layout.tiles_x) * width :][:height, :width]
                    for k in range(layout.slices)
                ]
            )
        tables.append(data)
    assert np.array_equal(*tables)


def test_a_mosaic_of_four_channels_skips_by_a_table_of_one(tmp_path):
    codes = blobs(22, (37, 30, 41))
    views = ("anterior-left", "superior")
    packing = Packing(slices_per_texel=4)
    plain, _ = pictures(tmp_path / "plain", codes, ES2, views, "orthographic", packing=packing)
    skipping, package = pictures(
        tmp_path / "skipping", codes, ES2, views, "orthographic", packing=packing, skip=("distance", 4)
    )
    assert next(each for each in package.manifest.textures if each.role == "volume").mosaic.slices_per_texel == 4
    check_same(skipping, plain)
