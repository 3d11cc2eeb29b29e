"""Levels of classified voxels: made of colours and opacities, and chosen by what they show."""

from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest
import tifffile
from sample_counts import samples_per_pixel

import volprep
from tests.support.phantom_scene import write_phantom_scene
from tests.support.thin_phantom import GRID, SOLID, VEIL, thin_things
from volprep.kernels import _native
from volprep.parts.levels.classified import CLASSIFIED_CANDIDATES, ClassifiedChooser, classified_slices
from volprep.parts.levels.level_input import LevelInput
from volprep.pipeline.build import build, plan_build
from volprep.pipeline.origin import read_origin
from volprep.render.renderer import Renderer
from volprep.scan import slabs
from volprep.scan.slabs import RawVolume
from volprep.scene.request import load_request
from volprep.transfer.lookup import lookup_table
from volprep.transfer.preclassified import Voxels
from volprep.truth.camera import standard_views
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.package.check import check
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent

FACTORS = [(2, 2, 2), (1, 4, 2)]
MADE_OF_COLOURS = ("transmittance", "least-squares")


def scan_of(folder, voxels, function=VEIL) -> LevelInput:
    path = folder / "level0.raw"
    voxels.tofile(path)
    volume = RawVolume(path, voxels.shape, voxels.dtype)
    grid = GRID if voxels.shape == GRID.shape_zyx else Grid.of(voxels.shape, (1.0, 0.9, 1.0))
    return LevelInput(volume, grid, {function.name: lookup_table(function, (0.0, 255.0), 256)})


def voxels_of(function=VEIL) -> Voxels:
    return Voxels(function, (0.0, 255.0), 2.0)


def level_of(scan, voxels, name, factors):
    slices = np.concatenate([each for each, _ in classified_slices(scan, voxels, name, factors)])
    return slices.reshape(*slices.shape[:2], -1, 4)


@pytest.mark.parametrize("name", CLASSIFIED_CANDIDATES)
@pytest.mark.parametrize("factors", FACTORS, ids=str)
def test_a_constant_stays_constant(tmp_path, name, factors) -> None:
    voxels = voxels_of()
    level = level_of(scan_of(tmp_path, np.full((9, 10, 7), 137, np.uint8)), voxels, name, factors)
    assert (level == voxels.texels(256)[137]).all()


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_transmittance_is_averaged_over_classified_voxels(tmp_path, dtype) -> None:
    codes = thin_things().astype(dtype) * (257 if dtype == np.uint16 else 1)
    voxels = voxels_of(SOLID)
    table = voxels.straight(256**codes.dtype.itemsize)
    expected = np.empty((*_native.box_reduced_shape(codes.shape, (2, 2, 2)), 4), np.float32)
    _native.rgba_reduce(table[codes], expected, (2, 2, 2), GRID.spacing_mm_zyx, voxels.reference_mm)
    expected[..., :3] *= expected[..., 3:]
    level = level_of(scan_of(tmp_path, codes), voxels, "transmittance", (2, 2, 2))
    assert np.array_equal(level, np.rint(expected * 255).astype(np.uint8))


@pytest.mark.parametrize("name", CLASSIFIED_CANDIDATES)
def test_no_colour_is_brighter_than_its_opacity(tmp_path, name) -> None:
    level = level_of(scan_of(tmp_path, thin_things()), voxels_of(), name, (2, 2, 2))
    assert (level[..., :3] <= level[..., 3:]).all()
    assert level[..., 3].max() > 100


@pytest.mark.parametrize("name", MADE_OF_COLOURS)
def test_slabs_give_the_same_bytes(tmp_path, monkeypatch, name) -> None:
    codes = thin_things()[:, ::2]
    scan = scan_of(tmp_path, codes)
    whole = level_of(scan, voxels_of(), name, (2, 2, 2))
    monkeypatch.setattr(slabs, "SLAB_BYTES", 3 * codes[0].nbytes)
    assert np.array_equal(level_of(scan, voxels_of(), name, (2, 2, 2)), whole)


@pytest.mark.parametrize("function", [VEIL, SOLID], ids=lambda each: each.name)
def test_the_light_of_a_level_is_that_of_its_voxels(tmp_path, function) -> None:
    # A level with the factors 1 is level 0, whose error is that of classification before the filter: small here.
    z, y, x = np.meshgrid(*(np.arange(n) for n in (24, 20, 22)), indexing="ij")
    scan = scan_of(tmp_path, (60 + 2 * z + 3 * y + x).astype(np.uint8), function)
    chooser = ClassifiedChooser(scan, voxels_of(function))
    choice, texels = chooser.choose(1, (1, 1, 1), ("box",), tmp_path.joinpath, lambda _: None)
    assert texels.shape_zyx == (24, 20, 4 * 22)
    assert choice.trials[0].rmse < 0.01


@pytest.mark.parametrize("function", [VEIL, SOLID], ids=lambda each: each.name)
@pytest.mark.parametrize("shape_zyx", [None, (1, 9, 9), (9, 1, 1)], ids=str)
def test_the_chosen_one_has_the_least_error(tmp_path, function, shape_zyx) -> None:
    codes = thin_things() if shape_zyx is None else np.random.default_rng(3).integers(0, 256, shape_zyx, np.uint8)
    factors = tuple(min(2, n) for n in codes.shape)
    chooser = ClassifiedChooser(scan_of(tmp_path, codes, function), voxels_of(function))
    choice, texels = chooser.choose(1, factors, CLASSIFIED_CANDIDATES, tmp_path.joinpath, lambda _: None)
    errors = {trial.filter: trial.rmse for trial in choice.trials}
    assert set(errors) == {"box", "transmittance", "least-squares"}
    assert errors[choice.filter] == min(errors.values())
    assert texels.path.name == f"1-{choice.filter}.raw"
    assert [path.name for path in tmp_path.glob("1-*")] == [texels.path.name]


def write_scene(folder, more=""):
    path = write_phantom_scene(folder, level_filter="auto")
    text = path.read_text()
    text = text[: text.index('[[transfer]]\nname = "core"')]
    path.write_text(f'crop = "none"\nrender = {{ classification = "preclassified" }}\n{more}\n{text}')
    return path


@pytest.fixture(scope="module")
def packages(tmp_path_factory) -> list[Package]:
    """Without a table of empty space, and with one."""
    found = []
    for kind in ("none", "distance"):
        folder = tmp_path_factory.mktemp(kind)
        more = f'skip = {{ kind = "{kind}", block = 2 }}'
        build(load_request(write_scene(folder, more)), folder / "phantom.volpkg", Silent())
        found.append(Package.open(folder / "phantom.volpkg"))
    return found


def test_no_filter_of_values_is_tried_but_the_one_to_compare_with(packages) -> None:
    package = packages[0]
    assert check(package.path) == []
    tried = {trial.filter for choice in read_origin(package.path).levels for trial in choice.trials}
    assert tried == set(CLASSIFIED_CANDIDATES)
    assert {level.filter for level in package.manifest.levels} <= {"none", *CLASSIFIED_CANDIDATES}
    assert [item.name for item in package.manifest.plan if item.name.startswith("filter of")]


def test_blocks_without_opacity_are_skipped_and_pictures_are_the_same(packages) -> None:
    plain, skipping = packages
    grid = plain.manifest.grid
    camera = standard_views(grid)["anterior-left"].box_from_clip(grid, 1.0)
    for table in skipping.manifest.skipping.tables:
        pictures, taken = [], []
        for package in packages:
            with Renderer(package, level=table.level) as renderer:
                pictures.append(renderer.render(camera, (48, 48)))
                taken.append(samples_per_pixel(package, renderer.program, table.level, camera, (48, 48))[0].sum())
        assert table.empty_share > 0.2
        assert np.abs(pictures[0] - pictures[1]).max() <= 1 / 255
        assert taken[1] < 0.9 * taken[0]


@pytest.mark.parametrize(
    ("more", "code"), [('pyramid = { filter = "transmittance" }', "VP3044"), ("skip = { ranges = true }", "VP3041")]
)
def test_what_needs_the_other_kind_of_voxels_is_refused(tmp_path, more, code) -> None:
    path = write_scene(tmp_path, more)
    text = path.read_text().replace("[pyramid]\ncoarsest_longest_axis = 16\n", "")
    if code == "VP3044":
        text = text.replace("preclassified", "lookup")
    path.write_text(text)
    with pytest.raises(VolprepError, match=code):
        plan_build(load_request(path), Silent())


@pytest.mark.parametrize(
    ("level_filter", "more", "is_refused"),
    [
        ("maximum", "", False),
        ("maximum", 'classification = "control-points"', True),
        ("maximum", 'compositing = "average"', True),
        ("maximum", '[lighting]\nbaked = "occlusion"', True),
        ("raised", 'compositing = "maximum"', False),
        ("minimum", 'compositing = "maximum"', True),
    ],
)
def test_extrema_that_nothing_makes_up_for_are_refused(tmp_path, level_filter, more, is_refused) -> None:
    scene = write_phantom_scene(tmp_path, level_filter=level_filter, more=f"[render]\n{more}\n")
    with pytest.raises(VolprepError, match="VP3285") if is_refused else nullcontext():
        plan_build(load_request(scene), Silent())


def test_coarse_stacks_of_slices_are_made_by_box(tmp_path) -> None:
    text = (Path(volprep.__file__).parent / "scene" / "profiles" / "gles1.toml").read_text()
    (tmp_path / "small.toml").write_text(text.replace("max_texture_bytes = 16_777_216", "max_texture_bytes = 60_000"))
    (channel,) = plan_build(
        load_request(write_phantom_scene(tmp_path, "small.toml", level_filter="auto")), Silent()
    ).channels
    (level,) = channel.levels
    assert level.index > 0
    assert level.filter == "box"


def test_on_a_real_shell_level_2_is_a_quarter_nearer_than_box(tmp_path, scans) -> None:
    codes = np.ascontiguousarray(tifffile.imread(scans / "qim_microct" / "shell_225x128x128.tif")[80:140])
    chooser = ClassifiedChooser(scan_of(tmp_path, codes), voxels_of())
    choice, _ = chooser.choose(2, (4, 4, 4), CLASSIFIED_CANDIDATES, tmp_path.joinpath, lambda _: None)
    errors = {trial.filter: trial.rmse for trial in choice.trials}
    assert errors[choice.filter] < 0.75 * errors["box"], errors
