"""The step of level 0 keeps its promise in the worst view: rays of views through the whole scan decide."""

import numpy as np
import pytest
from tiny_packages import function

from volprep.compositing import COMPOSITINGS
from volprep.parts.levels.label_rays import LabelLooks
from volprep.parts.levels.rays import RaySegments
from volprep.parts.levels.view_rays import FINER_PER_VOXEL, PER_VOXEL, ViewGroup, sampled, view_rays
from volprep.parts.programs.patch_rays import FINE, PatchRays
from volprep.parts.programs.step_bench import STEP_SHARE, StepBench
from volprep.pipeline.build import build
from volprep.plan.records import CropPlan
from volprep.render.renderer import Renderer
from volprep.scan.in_memory import InMemory
from volprep.scan.segments.record import VoxelBox
from volprep.scan.statistics import SlabMeasurer
from volprep.scene.request import load_request
from volprep.truth.camera import standard_views
from volprep.truth.decoded import level_volume, table_function
from volprep.truth.oracle import oracle_picture
from volprep.truth.seen import seen_pixels
from volprep_formats.grid import Grid
from volprep_formats.package.function_table import Table
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent
from volprep_formats.source import SourceInfo

SCENE = """
name = "s"
profile = "gles3"
crop = "none"
[pyramid]
coarsest_longest_axis = 64
[source]
path = "scan.raw"
[source.raw]
shape_zyx = [44, 28, 28]
dtype = "uint8"
spacing_mm_zyx = [1.0, 1.0, 1.0]
[[transfer]]
name = "a"
points = [
    { value = 70, colour = "#402818", extinction_per_mm = 0.0 },
    { value = 120, colour = "#c89868", extinction_per_mm = 0.6 },
    { value = 200, colour = "#fff0d8", extinction_per_mm = 1.5 },
]
"""


def long_body() -> np.ndarray:
    """A smooth body whose upper end is rough: views from above see little else."""
    z, y, x = np.indices((44, 28, 28)) - np.array([21.5, 13.5, 13.5])[:, None, None, None]
    inside = 1.0 - np.sqrt((z / 21) ** 2 + (y / 11) ** 2 + (x / 11) ** 2)
    values = 80 + 110 * np.clip(inside * 3 + 0.3, -0.7, 1)
    rough = np.random.default_rng(3).normal(scale=60.0, size=values.shape)
    values += np.where(z > 14, rough * (inside > -0.1), 0.0)
    return np.rint(np.clip(values, 0, 255)).astype(np.uint8)


def built(folder, codes: np.ndarray) -> Package:
    codes.tofile(folder / "scan.raw")
    (folder / "scene.toml").write_text(SCENE)
    build(load_request(folder / "scene.toml"), folder / "p.volpkg", Silent())
    return Package.open(folder / "p.volpkg")


def worst_rmse(package: Package) -> float:
    """Return the error of the step, over seen pixels, of the worst standard view."""
    volume, function = level_volume(package, 0), table_function(package, "a", 0)
    found = []
    with Renderer(package, level=0, target="rgba32f") as renderer:
        for camera in standard_views(volume.grid).values():
            view = camera.box_from_clip(volume.grid, 1.0)
            truth = oracle_picture(volume, function, view, (40, 40), 1e-6).rgba
            drawn = renderer.render(view, (40, 40))
            found.append(np.sqrt(np.mean((drawn - truth)[seen_pixels(drawn, truth)] ** 2)))
    return float(max(found))


def test_a_view_that_sees_only_the_finest_detail_is_drawn_as_exactly_as_the_plan_says(tmp_path) -> None:
    """With rays through patches of the scan the plan said 0.0016, and the views from above and below saw 0.0028."""
    package = built(tmp_path, long_body())
    assert worst_rmse(package) <= STEP_SHARE * package.manifest.render.tolerance.rmse


def test_rays_have_the_values_of_the_scan_whatever_its_type_and_the_part_that_is_level_0() -> None:
    codes = long_body()
    start_zyx, stop_zyx = (4, 2, 6), (40, 26, 22)
    grid = Grid.of(codes.shape, (1.0, 0.5, 2.0)).part(start_zyx, stop_zyx)
    found = []
    scans = (
        (codes, 1.0, 0.0),
        (codes.astype(np.int16) - 300, 1.0, 300.0),
        (codes.astype(np.uint16), 1.0, 0.0),
        (codes.astype(np.float32) / 2, 2.0, 0.0),
    )
    for stored, slope, intercept in scans:
        info = SourceInfo(
            format="raw",
            grid=Grid.of(codes.shape, (1.0, 0.5, 2.0)),
            stored_type=stored.dtype.name,
            slope=slope,
            intercept=intercept,
        )
        gauge = SlabMeasurer(info)
        gauge.add(stored)
        measured = gauge.result("0" * 64)
        crop = CropPlan(start_zyx=start_zyx, stop_zyx=stop_zyx)
        seen = np.ones(measured.blocks.shape_zyx, bool)
        found.append(view_rays(InMemory.of(stored), info, measured, seen, crop, grid, lit=()))
        before = stored.copy()
        view_rays(InMemory.of(stored), info, measured, seen, crop, grid)
        assert np.array_equal(stored, before)
    assert len(found[0]) > 16
    along_z = found[0][2].values
    assert along_z.shape[0] == 36 * 2 * (2 * FINE)
    means = along_z.reshape(36, -1, along_z.shape[1]).mean(axis=1)
    assert np.abs(np.corrcoef(means.mean(axis=1), codes[4:40, 2:26, 6:22].mean(axis=(1, 2)))[0, 1]) > 0.9
    for one, *others in zip(*found, strict=True):
        for other in others:
            np.testing.assert_allclose(other.values, one.values, atol=0.01)
            # Rounding may move a sample across the least slope, where light jumps.
            assert (np.abs(other.headlight - one.headlight) > 0.05).mean() < 1e-3


def rays_through(codes: np.ndarray, *, seen: bool, **how: object) -> list[PatchRays]:
    """Rays through all of a scan of which everything, or nothing, is seen."""
    info = SourceInfo(format="raw", grid=Grid.of(codes.shape, (1.0, 1.0, 1.0)), stored_type="uint8")
    gauge = SlabMeasurer(info)
    gauge.add(codes)
    measured = gauge.result("0" * 64)
    blocks = np.full(measured.blocks.shape_zyx, seen)
    crop = CropPlan(start_zyx=(0, 0, 0), stop_zyx=codes.shape)
    return view_rays(InMemory.of(codes), info, measured, blocks, crop, info.grid, **how)


def test_a_scan_of_which_nothing_is_seen_has_no_rays() -> None:
    assert not rays_through(long_body(), seen=False)


def test_finer_samples_lie_on_the_same_rays() -> None:
    codes = long_body()[:20]
    usual, finer = (rays_through(codes, seen=True, per_voxel=count) for count in (PER_VOXEL, FINER_PER_VOXEL))
    assert len(usual) == len(finer) > 16
    for one, other in zip(usual, finer, strict=True):
        assert 0 <= 4 * len(one.values) - len(other.values) < 4
        np.testing.assert_allclose(other.values.mean(axis=0), one.values.mean(axis=0), atol=1.0)


@pytest.mark.parametrize("shape_zyx", [(40, 1, 1), (2, 2, 2), (1, 60, 3)])
def test_a_volume_much_thinner_than_a_block_has_as_many_rays_as_others(shape_zyx) -> None:
    codes = np.random.default_rng(3).integers(0, 256, shape_zyx).astype(np.uint8)
    rays = rays_through(codes, seen=True)
    views = len(rays[0].views)
    counts = [sum(each.values[:, each.views[view]].shape[1] for each in rays) for view in range(views)]
    # Of 150 the shortest tenth are dropped, and those that are shorter than a voxel.
    assert min(counts) > 50, counts


def test_small_segments_have_as_much_of_the_error_along_rays_as_in_a_picture() -> None:
    """Segments of 1 to 3 voxels in a veil: by chance a view along an axis has a ray or two through them."""
    shape_zyx = (20, 22, 24)
    codes, labels = np.full(shape_zyx, 128, np.uint8), np.zeros(shape_zyx, np.uint16)
    boxes = [((5, 6, 7), (6, 7, 8)), ((12, 15, 16), (15, 16, 17)), ((9, 4, 12), (10, 6, 13))]
    for number, (start, stop) in enumerate(boxes, 1):
        labels[tuple(map(slice, start, stop))] = number
    looks = np.ones((1, 4, 4))
    looks[0, 0] = 0.01
    table = Table.exact(function((0.0, (1, 1, 1), 3.0), (255.0, (1, 1, 1), 3.0)))
    labelled = LabelLooks(InMemory.of(labels), looks, [VoxelBox(start_zyx=a, stop_zyx=b) for a, b in boxes])
    rays = rays_through(codes, seen=True, labelled=labelled)
    grid = Grid.of(shape_zyx, (1.0, 1.0, 1.0))
    lines = [every_line(grid, axis) for axis in range(3)]
    groups = [ViewGroup(axis, each) for axis, each in enumerate(lines)]
    pictures = sampled(InMemory.of(codes), grid.spacing_mm_zyx, groups, (0.0, 255.0), None, PER_VOXEL, labelled)
    along_rays, in_pictures = (
        StepBench(COMPOSITINGS["emission-absorption"], [table], each, is_segments=False).errors(1.4)
        for each in (rays, pictures)
    )
    for axis in range(3):
        assert along_rays[axis].rmse == pytest.approx(in_pictures[axis].rmse, rel=0.25)


def every_line(grid: Grid, axis: int) -> RaySegments:
    """Rays along an axis, four for each row of voxels."""
    sides = [np.arange(0.25, extent_mm, 0.5) for extent_mm in grid.extent_mm_zyx[::-1]]
    sides[axis] = np.zeros(1)
    starts = np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, 3)
    lengths_mm = np.full(len(starts), grid.extent_mm_zyx[::-1][axis] * (1 - 1e-9))
    return RaySegments(starts, np.tile(np.eye(3)[axis], (len(starts), 1)), lengths_mm)
