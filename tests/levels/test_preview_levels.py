"""Levels whose light along random rays is too far from that of level 0 are for previews, however they are drawn."""

import dataclasses

import numpy as np
import pytest
from phantom_scene import write_phantom_scene

from volprep.compositing import COMPOSITINGS
from volprep.parts.levels.choose_level import Chooser
from volprep.parts.levels.level_input import LevelInput, level_slices, written
from volprep.parts.levels.preview import preview_levels, preview_reason
from volprep.parts.levels.rays import RaySegments, sample_level
from volprep.parts.levels.rendered_rays import RaySight, SeenLevels
from volprep.pipeline.build import build
from volprep.pipeline.remarks import warnings
from volprep.plan.level_choice import LevelChoice, LightError, Trial
from volprep.scan.slabs import RawVolume
from volprep.scene.request import load_request
from volprep.transfer.lookup import lookup_table
from volprep_formats.grid import Grid
from volprep_formats.package.channel import LevelFilter
from volprep_formats.package.manifest import Manifest, Tolerance
from volprep_formats.package.parts.normals.record import SOFT_SLOPE
from volprep_formats.package.transfer_function import TransferFunction, TransferPoint
from volprep_formats.progress import Silent

FACTORS = (2, 2, 2)
WINDOW = (0.0, 255.0)
SHELL = TransferFunction(
    name="shell",
    isovalue=110.0,
    points=(
        TransferPoint(value=60.0, colour=(0.8, 0.2, 0.1), extinction_per_mm=0.0),
        TransferPoint(value=140.0, colour=(0.9, 0.8, 0.3), extinction_per_mm=0.4),
        TransferPoint(value=220.0, colour=(0.2, 0.9, 0.9), extinction_per_mm=1.2),
    ),
)
PLAIN = RaySight((SHELL,), WINDOW, "linear", COMPOSITINGS["emission-absorption"], lit=False)


def choice(level: int, *rmse: float) -> LevelChoice:
    errors = tuple(LightError(transfer=f"function {k}", rmse=each) for k, each in enumerate(rmse))
    return LevelChoice(level=level, filter="box", errors=errors)


def test_the_transfer_function_with_the_largest_error_decides_and_coarser_levels_follow() -> None:
    choices = [choice(1, 0.001, 0.024), choice(2, 0.026, 0.001), choice(3, 0.002)]
    assert preview_levels(choices, 0, Tolerance(rmse=0.05, flip=1.0)) == {2, 3}
    assert preview_levels(choices, 0, Tolerance(rmse=0.04, flip=1.0)) == {1, 2, 3}
    assert preview_levels(choices, 0, Tolerance(rmse=0.06, flip=1.0)) == set()


def tried(level: int, name: LevelFilter, rmse: float, seen_rmse: float) -> LevelChoice:
    trial = Trial(filter=name, transfer="shell", table="common", rmse=rmse, seen_rmse=seen_rmse, seconds=0.0)
    return LevelChoice(level=level, filter=name, trials=(trial,))


def test_the_error_along_rays_that_are_aimed_at_what_is_seen_counts() -> None:
    tolerance = Tolerance(rmse=0.02, flip=1.0)
    assert preview_levels([tried(1, "median", 0.003, seen_rmse=0.011)], 0, tolerance) == {1}
    assert preview_levels([tried(1, "median", 0.003, seen_rmse=0.009)], 0, tolerance) == set()


def test_a_level_is_for_previews_if_its_flip_may_be_beyond_the_tolerance() -> None:
    assert preview_levels([choice(1, 0.0039)], 0, Tolerance()) == {1}
    assert preview_levels([choice(1, 0.0037)], 0, Tolerance()) == set()
    assert preview_levels([choice(1, 0.0039)], 0, Tolerance(flip=0.04)) == set()


def test_the_finest_level_of_a_package_is_never_for_previews_whatever_its_error() -> None:
    choices = [choice(1, 0.5), choice(2, 0.001), choice(3, 0.5)]
    assert preview_levels(choices, 1, Tolerance(rmse=0.02, flip=1.0)) == {3}


def test_the_reason_has_the_numbers_or_names_a_finer_level() -> None:
    tolerance = Tolerance(rmse=0.02, flip=1.0)
    assert preview_reason(tried(2, "median", 0.001, seen_rmse=0.0321), tolerance) == (
        "for previews only: along rays its light is 0.032 from that of level 0, 0.01 is allowed; "
        "validate finds the largest pictures in which it is right"
    )
    assert preview_reason(choice(3, 0.002), tolerance) == "for previews only: a finer level is, too"


@pytest.fixture
def scan(tmp_path) -> LevelInput:
    """A ball in noise, of voxels that are no cubes; the table is that of the transfer function."""
    spacing = (1.5, 1.0, 0.75)
    sides = [h * (np.arange(n) - (n - 1) / 2) for n, h in zip((17, 26, 35), spacing, strict=True)]
    z, y, x = np.meshgrid(*sides, indexing="ij")
    noise = np.random.default_rng(5).normal(0, 6, x.shape)
    voxels = np.clip(235 - 14 * np.sqrt(x**2 + y**2 + z**2) + noise, 0, 255).astype(np.uint8)
    path = tmp_path / "level0.raw"
    voxels.tofile(path)
    table = lookup_table(SHELL, WINDOW, 256)
    return LevelInput(RawVolume(path, voxels.shape, voxels.dtype), Grid.of(voxels.shape, spacing), {"shell": table})


def level_of(scan: LevelInput, tmp_path, name="box") -> RawVolume:
    slices = level_slices(scan, name, FACTORS)
    return written(slices, tmp_path / "level1.raw", scan.shape_zyx(FACTORS), lambda _: None)


def error(scan: LevelInput, level: RawVolume, factors=FACTORS, **changes) -> float:
    (found,) = SeenLevels(scan, dataclasses.replace(PLAIN, **changes)).errors(level, factors, ())
    return found.rmse


def test_light_without_lighting_is_that_by_which_levels_are_chosen(scan, tmp_path) -> None:
    chosen, level = Chooser(scan, adapt=True).choose(1, FACTORS, ("box",), tmp_path.joinpath, lambda _: None)
    assert [table.transfer for table in chosen.tables] == ["shell"]
    (tried,) = chosen.tried
    (seen,) = SeenLevels(scan, PLAIN).errors(level, FACTORS, chosen.tables)
    # Other rays, and tables that are linear between control points, not between 256 entries.
    assert seen.rmse == pytest.approx(tried.rmse, rel=0.1)
    assert error(scan, level) > seen.rmse


def test_a_lit_level_drops_tables_with_which_its_light_is_further_away(scan, tmp_path) -> None:
    chosen, level = Chooser(scan, adapt=True).choose(1, FACTORS, ("box",), tmp_path.joinpath, lambda _: None)
    (own,) = chosen.tables
    dark = own.model_copy(update={"entries": tuple((r / 2, g / 2, b / 2, tau) for r, g, b, tau in own.entries)})
    seen = SeenLevels(scan, dataclasses.replace(PLAIN, lit=True))
    with_own, common = (seen.errors(level, FACTORS, tables)[0].rmse for tables in (chosen.tables, ()))
    assert with_own < common
    tables, dropped, errors = seen.chosen(level, FACTORS, (own,))
    assert (tables, dropped, errors[0].rmse) == ((own,), (), with_own)
    tables, (lost,), errors = seen.chosen(level, FACTORS, (dark,))
    assert (tables, lost.transfer, errors[0].rmse, lost.common_rmse) == ((), "shell", common, common)
    assert lost.rmse > common


@pytest.mark.parametrize("name", sorted(COMPOSITINGS))
@pytest.mark.parametrize("lit", [False, True])
def test_level_0_has_no_error_and_another_one_has(name, lit, scan, tmp_path) -> None:
    compositing = COMPOSITINGS[name]
    if lit and not compositing.lit:
        pytest.skip("has no light")
    level = level_of(scan, tmp_path)
    assert error(scan, scan.volume, (1, 1, 1), compositing=compositing, lit=lit) == 0.0
    assert error(scan, level, compositing=compositing, lit=lit) > 1e-4


def test_light_tells_levels_apart_that_look_alike_without(tmp_path) -> None:
    """A ramp with waves that the transfer function does not show: only gradients differ."""
    z, y, x = np.meshgrid(np.arange(16), np.arange(16), np.arange(16), indexing="ij")
    voxels = (100 + 6 * z + 20 * ((x + y) % 2)).astype(np.uint8)
    path = tmp_path / "waves.raw"
    voxels.tofile(path)
    grey = SHELL.model_copy(
        update={"points": tuple(TransferPoint(value=v, colour=(1, 1, 1), extinction_per_mm=0.2) for v in (0.0, 255.0))}
    )
    scan = LevelInput(RawVolume(path, voxels.shape, voxels.dtype), Grid.of(voxels.shape, (1.0, 1.0, 1.0)), {})
    level = level_of(scan, tmp_path)
    assert error(scan, level, functions=(grey,)) < 1e-3
    assert error(scan, level, functions=(grey,), lit=True) > 0.05


def test_light_from_the_viewer_is_the_cosine_of_ray_and_gradient(tmp_path) -> None:
    """Opaque matter whose values grow along z alone: its light is that of its first sample, and follows direction z."""
    z = np.arange(24)[:, None, None]
    voxels = np.broadcast_to(100 + 4 * z, (24, 20, 20)).astype(np.uint8)
    path = tmp_path / "ramp.raw"
    np.ascontiguousarray(voxels).tofile(path)
    scan = LevelInput(RawVolume(path, voxels.shape, voxels.dtype), Grid.of(voxels.shape, (2.0, 1.0, 1.0)), {})
    opaque = SHELL.model_copy(
        update={"points": tuple(TransferPoint(value=v, colour=(1, 1, 1), extinction_per_mm=1e3) for v in (0.0, 255.0))}
    )
    seen = SeenLevels(scan, dataclasses.replace(PLAIN, functions=(opaque,), lit=True))
    light = seen.truth["shell"]
    assert np.allclose(light[:, 3], 1.0)
    lines = seen._lines
    voxels_from_end = np.minimum(lines.starts_mm_xyz[:, 2], 48.0 - lines.starts_mm_xyz[:, 2]) / 2.0
    # In the outer half voxels one of the values beside is that of the outer voxel: half of the slope.
    outer, inner = voxels_from_end < 0.3, voxels_from_end > 1.7
    assert outer.sum() > 100
    slope_per_mm = np.where(outer, 0.5, 1.0) * 4 / 255 / 2
    expected = np.hypot(slope_per_mm * lines.directions_xyz[:, 2], SOFT_SLOPE) / np.hypot(slope_per_mm, SOFT_SLOPE)
    chosen = outer | inner
    assert np.allclose(light[chosen, 0], expected[chosen], atol=1e-3)


def test_labels_are_sampled_where_the_sample_lies_and_never_mixed(monkeypatch, tmp_path) -> None:
    voxels = np.random.default_rng(3).integers(0, 7, (9, 6, 5)).astype(np.uint8)
    path = tmp_path / "labels.raw"
    voxels.tofile(path)
    volume = RawVolume(path, voxels.shape, voxels.dtype)
    spacing = (2.0, 1.0, 1.5)
    starts = np.array([[0.1, 0.2, 0.3], [7.4, 0.0, 17.9], [3.0, 5.9, 8.0]])
    ends = np.array([[7.2, 5.8, 17.0], [0.1, 5.9, 0.1], [3.0, 0.1, 8.0]])
    lengths = np.linalg.norm(ends - starts, axis=1)
    lines = RaySegments(starts, (ends - starts) / lengths[:, None], lengths)
    # Slabs of two slices: a voxel belongs to one of them.
    monkeypatch.setattr(
        "volprep.parts.levels.rays.slab_ranges", lambda depth, _: [(z, min(z + 2, depth)) for z in range(0, depth, 2)]
    )
    samples = sample_level(volume, spacing, lines, between="nearest", multiple=4)
    expected = []
    for ray, length in enumerate(lengths):
        count = samples.offsets[ray + 1] - samples.offsets[ray]
        assert count % 4 == 0
        for k in range(count):
            at = starts[ray] + (k + 0.5) * length / count * lines.directions_xyz[ray]
            x, y, z = (int(place // h) for place, h in zip(at, spacing[::-1], strict=True))
            expected.append(voxels[z, y, x])
    assert samples.values.tolist() == expected


def built(folder, more: str = "", level_filter: str = "auto") -> Manifest:
    scene = write_phantom_scene(folder, level_filter=level_filter)
    text = scene.read_text(encoding="utf-8").replace("coarsest_longest_axis = 16", "coarsest_longest_axis = 4")
    scene.write_text(text + more, encoding="utf-8")
    return build(load_request(scene), folder / "phantom.volpkg", Silent())


@pytest.mark.long
def test_a_build_marks_them_and_the_plan_says_why(tmp_path) -> None:
    manifest = built(tmp_path)
    marked = [level.index in manifest.previews for level in manifest.levels]
    assert marked == sorted(marked)
    assert not marked[0]
    assert marked[-1]
    reasons = {item.name: item.reason for item in manifest.plan}
    for level in manifest.levels:
        assert ("for previews only: " in reasons[f"level {level.index}"]) == (level.index in manifest.previews)
    # The draft of another tolerance begins with the same levels, and they are judged again.
    assert not built(tmp_path, "[tolerance]\nrmse = 0.9\nflip = 1.0\n").previews


@pytest.mark.long
def test_the_key_is_absent_from_the_manifest_where_it_is_not_true(tmp_path) -> None:
    built(tmp_path)
    text = (tmp_path / "phantom.volpkg" / "manifest.json").read_text(encoding="utf-8")
    assert '"preview_only": true' in text
    assert text.count("preview_only") == text.count('"preview_only": true')


@pytest.mark.parametrize(("level_filter", "warned"), [("nearest", {"1", "2", "3"}), ("appearance", set())])
def test_a_filter_of_the_scene_that_is_worse_than_box_means_is_told(tmp_path, level_filter, warned) -> None:
    manifest = built(tmp_path, level_filter=level_filter)
    said = [remark for remark in warnings(manifest) if "worse than box means" in remark]
    assert {remark.split()[1] for remark in said} == warned
    assert all(f"with filter {level_filter}, " in remark for remark in said)
