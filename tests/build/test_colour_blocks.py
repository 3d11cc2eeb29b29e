"""Volumes in colour in compressed blocks: made only where pictures bear it, drawn and read as they were judged."""

from pathlib import Path

import numpy as np
import pytest
from colour_scene import write_colour_scene, write_pictures
from judged import validate
from scene_builds import built, planned

from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.channel_packages import channel_packages
from volprep_formats.package.check import check
from volprep_formats.package.level_texels import level_texels
from volprep_formats.package.manifest import Manifest, PlanItem
from volprep_formats.package.reader import Package
from volprep_formats.textures import ktx2
from volprep_formats.textures.mosaic import slices_of_mosaic

FORM = "astc-4x4-unorm-srgb"
ANY = "[tolerance]\nrmse = 1.0\nmaximum = 1.0\nflip = 1.0\n"
"""Small volumes change within a few voxels, which no block bears at the usual tolerance."""
SMALL = "[render]\npicture_size = 16\n"

pytestmark = pytest.mark.usefixtures("kept_workers")


def blue() -> np.ndarray:
    """A box of blue behind clear voxels: what reads the red of it, or its green, finds nothing."""
    pixels = np.zeros((9, 14, 51, 4), np.uint8)
    pixels[2:6, 3:9, 39:] = (0, 0, 220, 255)
    return pixels


def scene_of(folder: Path, compression: str, tables: str, pixels: np.ndarray | None = None) -> Path:
    textures = f'[textures]\ncompression = "{compression}"\n{SMALL}{tables}'
    scene = write_colour_scene(folder, "gles3-astc", top='crop = "none"', tables=textures)
    if pixels is not None:
        write_pictures(folder / "slices.tif", pixels)
    return scene


def said(manifest: Manifest) -> PlanItem:
    (item,) = (each for each in manifest.plan if each.kind == "compression")
    return item


@pytest.fixture(scope="module")
def package(tmp_path_factory) -> Package:
    """A ball in blocks."""
    return built(scene_of(tmp_path_factory.mktemp("blocks"), "astc-4x4", ANY))


def test_a_package_in_blocks_is_sound_and_has_the_error_that_the_plan_says(package: Package, tmp_path: Path) -> None:
    manifest = package.manifest
    formats = {each.format for each in manifest.textures}
    assert formats == {"astc-4x4-unorm-srgb"}
    assert check(package.path) == []
    # The files are derived again from the pictures, and the driver draws them.
    report = validate(package.path, tmp_path / "report")
    assert report.verdict.passed
    (form,) = manifest.compression
    assert (form.format, form.channel, form.kept, form.pictures) == (FORM, "red", True, 9)
    data = [view.data for program in report.programs for view in program.views]
    # Of what is decoded, 16 bits are kept.
    assert form.rmse == pytest.approx(max(error.seen_rmse for error in data), abs=2e-5)
    assert form.maximum == pytest.approx(max(error.maximum for error in data), abs=2e-4)
    assert form.rmse > 0.005
    assert said(manifest).reason.startswith("8 bits a voxel; encoded whole, it changes 9 standard views by RMSE")


@pytest.mark.long(keep=1)
@pytest.mark.parametrize(
    "tolerance",
    ["[tolerance]\nrmse = 1.0\nmaximum = 1.0\nflip = 0.01\n", "", "[tolerance]\nmaximum = 1.0\nflip = 1.0\n"],
    ids=["flip", "usual", "rmse"],
)
def test_blocks_that_change_pictures_are_refused_with_their_numbers(tmp_path: Path, tolerance: str) -> None:
    package = built(scene_of(tmp_path, "auto", tolerance))
    assert {each.format for each in package.manifest.textures} == {"rgba8unorm-srgb"}
    assert {each.dimension for each in package.manifest.textures} == {"3d"}
    (form,) = package.manifest.compression
    item = said(package.manifest)
    assert (form.kept, item.kept) == (False, False)
    assert f"RMSE {form.rmse:.2g}, {form.maximum:.2g} at most, FLIP" in item.reason
    assert item.reason.endswith("not within half of the tolerance")


@pytest.mark.parametrize(
    ("compression", "skip", "most"),
    [
        ("none", "", 0.0),
        # At 0, one code of difference between GPUs counts as visible, and nothing is skipped.
        ("astc-4x4", '[skip]\nkind = "distance"\nblock = 3\n[lab.skip]\nepsilon = 0.9\n', 1 / 255),
    ],
)
def test_rays_skip_what_is_clear_and_nothing_else(tmp_path: Path, compression: str, skip: str, most: float) -> None:
    package = built(scene_of(tmp_path, compression, f"{ANY}{skip}", blue()))
    manifest = package.manifest
    table = next(each for each in manifest.skipping.tables if each.level == 0)
    texture = next(each for each in manifest.textures if each.name == table.texture)
    held = ktx2.decode(package.read_bytes(texture.file), texture.file).data
    entries = held if texture.mosaic is None else slices_of_mosaic([held[0]], texture.mosaic)
    alpha = level_texels(channel_packages(package)["opacity"], 0)
    assert alpha.max() == (1.0 if alpha.dtype.kind == "f" else 255)
    assert 0.2 < table.empty_share < 0.95
    for k, j, i in np.ndindex(table.blocks_zyx):
        # A block of B cells has B + 1 voxels along an axis.
        inside = alpha[tuple(slice(n * table.block, n * table.block + table.block + 1) for n in (k, j, i))]
        assert entries[k, j, i] == 0 or inside.max() <= most


def test_a_plan_without_a_build_says_that_a_build_tries_it(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, "auto", ANY)
    found = planned(scene)
    (item,) = (each for each in found.items if each.kind == "compression")
    assert (item.kept, item.name) == (False, f"textures as {FORM}")
    assert "a build tries the whole level" in item.reason


def test_profiles_without_the_extension_refuse_it_where_it_is_named(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, "astc-4x4", "")
    named = scene.read_text().replace("gles3-astc", "gles3")
    scene.write_text(named)
    with pytest.raises(VolprepError, match="VP3070"):
        planned(scene)
    scene.write_text(named.replace('"astc-4x4"', '"auto"'))
    (item,) = (each for each in planned(scene).items if each.kind == "compression")
    assert item.reason == "profile gles3 has no astc-4x4-unorm, the only form of a volume in colour"
