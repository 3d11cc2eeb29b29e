"""BrickFile on demand: all of them are level 0, some of them are as near as they say, and a damaged one is named."""

import math
import re
import shutil
from importlib.resources import files
from zlib import crc32

import numpy as np
import pytest
from brick_loss_twin import brick_loss
from brick_scene import ON_DEMAND, TRANSFER, voxels
from scene_builds import built, planned, view_of, write_raw_scene

from volprep.parts.on_demand.loss import CodeLook
from volprep.pipeline.shot import Shot, draw
from volprep.plan.products import OnDemandPlan
from volprep.render.on_demand.bricks import BrickFile
from volprep.render.on_demand.choice import ChosenBricks, choose, held_of, in_order
from volprep.render.on_demand.inputs import edit_of, from_bricks
from volprep.render.on_demand.rays import levels_at_cells, view_loss
from volprep.render.renderer import Renderer
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.function_table import Table
from volprep_formats.package.parts.on_demand.brick import decode_brick, encode_brick
from volprep_formats.package.parts.on_demand.record import BrickLevel, OnDemand
from volprep_formats.package.reader import Package
from volprep_formats.package.transfer_function import TransferFunction, TransferPoint
from volprep_formats.textures.zstd_frames import FrameError

VIEWS = ("anterior", "left", "anterior-left", "superior", "posterior")
PIXELS = (64, 64)


SMALL = np.arange(1000, dtype=np.uint16).astype(np.uint8).reshape(10, 10, 10)


LIT = '[render]\nlighting = "headlight"\n[lighting]\nnormals = "central"\n'


@pytest.fixture(scope="module", params=["", LIT], ids=["unlit", "lit"])
def package(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp("on-demand")
    return built(write_raw_scene(folder, voxels(), TRANSFER + ON_DEMAND + request.param))


@pytest.fixture(scope="module")
def bricks(package):
    return BrickFile.of(package)


def from_held(package, held, view):
    with Renderer(package, target="rgba32f", edit=edit_of(BrickFile.of(package), held, None)) as renderer:
        return renderer.render(view_of(package.manifest.grid, view), PIXELS)


def error(picture, truth):
    """Root mean square over seen pixels."""
    seen = np.maximum(picture, truth).max(axis=-1) > 0.5 / 255
    return float(np.sqrt(((picture - truth)[seen] ** 2).mean())) if seen.any() else 0.0


@pytest.mark.parametrize("view", VIEWS)
def test_all_bricks_draw_the_picture_of_level_0(package, bricks, view):
    with Renderer(package, target="rgba32f", level=0) as renderer:
        level = renderer.render(view_of(package.manifest.grid, view), PIXELS)
    found = from_held(package, bricks.stored, view)
    assert level.max() > 0.3
    np.testing.assert_allclose(found, level, atol=2e-4)


@pytest.mark.parametrize("view", VIEWS)
def test_the_error_of_some_bricks_is_within_the_stated_bound_and_near_it(package, bricks, view):
    truth = from_held(package, bricks.stored, view)
    seen = view_loss(bricks, view_of(package.manifest.grid, view), PIXELS)
    ratios, before = [], np.inf
    for places in (0, 12, 16, 24, 40, 60, 80):
        found = choose(bricks, seen, places, 0.0)
        real = error(from_held(package, found.held, view), truth)
        assert real <= found.bound + 1e-3
        assert found.bound <= before
        before = found.bound
        if real > 1e-3:
            ratios.append(found.bound / real)
    assert len(ratios) >= 3
    # Noise of bricks behind each other, and of levels, adds up in the bound and cancels in the picture.
    assert np.median(ratios) < 6.0


def test_bricks_with_the_greatest_loss_beat_the_nearest_ones(package, bricks):
    view = "anterior-left"
    truth = from_held(package, bricks.stored, view)
    seen = view_loss(bricks, view_of(package.manifest.grid, view), PIXELS)
    own = list(in_order(bricks, seen.gains(bricks)))
    found = choose(bricks, seen, 30, 0.0)
    backwards = held_of(bricks, sorted(own, key=lambda each: (-each[0], each[1]))[: found.bricks - 8])
    assert error(from_held(package, found.held, view), truth) < error(from_held(package, backwards, view), truth)


def test_a_target_takes_no_more_bricks_than_it_needs(package, bricks):
    seen = view_loss(bricks, view_of(package.manifest.grid, "left"), PIXELS)
    near, far = choose(bricks, seen, 1000, 0.02), choose(bricks, seen, 1000, 0.1)
    assert near.bound <= 0.02 < far.bound <= 0.1
    assert far.bricks < near.bricks < sum(int(each.sum()) for each in bricks.stored)


def test_a_brick_comes_after_the_one_that_covers_it(package, bricks):
    seen = view_loss(bricks, view_of(package.manifest.grid, "left"), PIXELS)
    found = set()
    for level, place in in_order(bricks, seen.gains(bricks)):
        parent = bricks.parent(level, place)
        is_there = level + 1 == bricks.coarsest or not bricks.stored[level + 1][parent]
        assert is_there or (level + 1, parent) in found
        found.add((level, place))
    assert len(found) > 50


def test_the_finest_brick_that_is_held_is_drawn(bricks):
    held = held_of(bricks, [])
    level = levels_at_cells(bricks, held)
    z, y, x = (int(at[0]) for at in np.nonzero(bricks.stored[0]))
    assert level[z, y, x] > 0
    assert (level[~bricks.stored[0]] == 0).all()
    held[0][z, y, x] = True
    assert levels_at_cells(bricks, held)[z, y, x] == 0


def damaged(package, tmp_path):
    """A copy of a package with one byte of its last brick changed, and the place of that brick."""
    target = tmp_path / "damaged.volpkg"
    shutil.copytree(package.path, target)
    file = target / package.manifest.on_demand.bricks
    data = bytearray(file.read_bytes())
    data[-3] ^= 0x40
    file.write_bytes(data)
    return Package.open(target)


def test_a_damaged_brick_is_named_and_drawn_from_the_coarser_level(package, bricks, tmp_path):
    broken = BrickFile.of(damaged(package, tmp_path))
    told = []
    inputs = from_bricks(broken, broken.stored, None, told.append)
    (problem,) = told
    assert problem.code == "VP5043"
    assert "level 0" in str(problem)
    last = tuple(int(at[-1]) for at in np.nonzero(bricks.stored[0]))
    whole = from_bricks(bricks, bricks.stored, None)
    assert whole.texels["brick-pages"][last][3] == 1
    assert inputs.texels["brick-pages"][last][3] == 2
    with pytest.raises(VolprepError, match="damaged"):
        from_bricks(broken, broken.stored, None)


def test_a_picture_from_a_memory_says_what_is_missing(package):
    def taken(brick_bytes):
        shot = Shot(None, None, PIXELS, "black", None, None, None, None, brick_bytes=brick_bytes)
        return draw(package.path, shot)[1].notes

    (some,) = taken(20 * package.manifest.on_demand.brick_bytes)
    (every,) = taken(10**9)
    assert "of the picture of all bricks: 20 of" in some
    assert every.startswith("within 0")


@pytest.mark.parametrize(
    ("tables", "what"),
    [
        ("[grid]\nsize = 16\n", "grid"),
        ('[render]\nlighting = "headlight"\n', "normals volume"),
        ('[render]\ncompositing = "maximum"\n', "compositing maximum"),
        ('[render]\nclassification = "preclassified"\n', "classification preclassified"),
        ('[render]\ntechnique = "slabs"\n', "technique slabs"),
    ],
)
def test_what_bricks_on_demand_do_not_support_is_refused(tmp_path, tables, what):
    scene = write_raw_scene(tmp_path, SMALL, TRANSFER + ON_DEMAND + tables)
    with pytest.raises(VolprepError, match=what) as raised:
        planned(scene)
    assert raised.value.code == "VP3034"


@pytest.mark.parametrize("profile", ["gles1", "gles2-4096"])
def test_devices_without_3d_textures_are_refused(tmp_path, profile):
    scene = write_raw_scene(tmp_path, SMALL, TRANSFER + ON_DEMAND, profile=profile)
    with pytest.raises(VolprepError, match=profile) as raised:
        planned(scene)
    assert raised.value.code == "VP3034"


SMALL_MEMORY = '[textures]\nmemory_bytes = 30_000\n[on_demand]\nsize = 6\nuse = "{use}"\n'


def item_of(plan):
    """The item of the plan about bricks on demand, or None."""
    return next((item for item in plan.items if item.kind == "on-demand"), None)


def test_a_scan_that_does_not_fit_is_in_bricks(tmp_path):
    plan = planned(write_raw_scene(tmp_path, voxels(), TRANSFER + SMALL_MEMORY.format(use="auto")))
    found = plan.channels[0].part(OnDemandPlan)
    assert found is not None
    assert [level.index for level in plan.channels[0].levels] == [1, 2]
    item = item_of(plan)
    assert item.kept
    assert item.reason.startswith("the whole scan does not fit: 47730 bytes")
    # Levels that the package holds whole have the rest of the memory.
    assert found.places * found.brick_bytes <= 15_000
    assert all(math.prod(volume.shape_zyx) <= 15_000 for volume in plan.channels[0].volumes)


@pytest.mark.parametrize(
    ("use", "tables", "reason"),
    [
        ("never", "", "wants none"),
        ("auto", '[render]\ncompositing = "maximum"\n', "compositing maximum"),
        ("auto", "[grid]\nsize = 8\n", r"\[grid\]"),
        ("auto", "[proxy]\n", r"\[proxy\]"),
    ],
)
def test_the_plan_says_why_a_scan_that_does_not_fit_is_not_in_bricks(tmp_path, use, tables, reason):
    plan = planned(write_raw_scene(tmp_path, voxels(), TRANSFER + SMALL_MEMORY.format(use=use) + tables))
    assert plan.channels[0].part(OnDemandPlan) is None
    item = item_of(plan)
    assert not item.kept
    assert re.search(reason, item.reason)


@pytest.mark.parametrize("largest", [32, 33])
def test_a_device_whose_textures_hold_no_brick_has_none(tmp_path, largest):
    text = (files("volprep.scene.profiles") / "gles3.toml").read_text()
    own = text.replace("max_3d_texture_size = 1024", f"max_3d_texture_size = {largest}").replace('"gles3"', '"own"')
    (tmp_path / "own.toml").write_text(own)
    plan = planned(write_raw_scene(tmp_path, voxels(), TRANSFER, profile="own.toml"))
    assert plan.channels[0].part(OnDemandPlan) is None
    assert "does not hold the coarsest level" in item_of(plan).reason


def test_a_scan_that_fits_is_not_in_bricks(tmp_path):
    assert item_of(planned(write_raw_scene(tmp_path, voxels(), TRANSFER))) is None


LAYOUT = OnDemand(
    index="i",
    bricks="b",
    size=3,
    ghost=1,
    levels=(BrickLevel(factors_zyx=(1, 1, 1)),),
    format="r8unorm",
    places_zyx=(1, 1, 1),
)


@pytest.mark.parametrize(("texel", "dtype"), [("r8unorm", np.uint8), ("r16unorm", np.uint16), ("r16float", np.float16)])
def test_a_brick_arrives_as_it_was(texel, dtype):
    layout = LAYOUT.model_copy(update={"format": texel})
    texels = (np.random.default_rng(2).random((5, 5, 5)) * 200).astype(dtype)
    data = encode_brick(texels)
    found = decode_brick(data, crc32(data), layout)
    assert found.dtype == dtype
    np.testing.assert_array_equal(found, texels)
    with pytest.raises(FrameError, match="CRC-32"):
        decode_brick(data[:-1], crc32(data), layout)
    other = encode_brick(np.zeros((5, 5, 5), np.uint8))
    with pytest.raises(FrameError, match="hold 125 bytes"):
        decode_brick(other, crc32(other), LAYOUT.model_copy(update={"size": 4}))


def test_the_loss_of_a_brick_is_that_of_its_columns():
    """The twin of the kernel, sample by sample."""
    rng = np.random.default_rng(4)
    points = [(0.0, (0.1, 0.5, 0.2), 0.0), (255.0, (1.0, 0.3, 0.6), 0.8)]
    function = TransferFunction(
        name="f", points=[TransferPoint(value=v, colour=c, extinction_per_mm=e) for v, c, e in points]
    )
    look = CodeLook.of(Table.exact(function), (0.0, 255.0), 8)
    fine, coarse = (rng.integers(0, 256, (3, 4, 5)).astype(np.float32) for _ in range(2))
    spacing = (1.5, 0.7, 1.1)

    def column(codes, mm):
        light, through = np.zeros(3), 1.0
        for k, code in enumerate(codes):
            colour, tau = np.array([0.1, 0.5, 0.2]) + code / 255 * np.array([0.9, -0.2, 0.4]), 0.8 * code / 255
            part = mm / 8 if k in {0, len(codes) - 1} else mm
            light += through * (1 - np.exp(-tau * part)) * colour
            through *= np.exp(-tau * part)
        return light, 1 - through

    worst = 0.0
    for axis in range(3):
        ours, others = (np.moveaxis(each, axis, -1) for each in (fine, coarse))
        rows, columns = ours.shape[:2]
        for turn in (1, -1):
            total = 0.0
            for i, k in np.ndindex(rows, columns):
                mm = spacing[axis]
                (c1, a1), (c2, a2) = column(ours[i, k, ::turn], mm), column(others[i, k, ::turn], mm)
                change, alpha = c2 - c1, a2 - a1
                squares = [*(np.maximum(abs(change), abs(change - alpha)) ** 2), alpha**2]
                is_inner = 0 < i < rows - 1 and 0 < k < columns - 1
                total += np.mean(squares) * (1 if is_inner else 1 / 8)
            worst = max(worst, np.sqrt(total / ((rows - 2) * (columns - 2))))
    found = brick_loss(fine, coarse, spacing, [look])
    assert found.loss[0] == pytest.approx(worst, rel=1e-4)
    assert (np.diff(found.loss) <= 1e-6).all()
    assert brick_loss(fine, None, spacing, [look]).loss.tolist() == [0.0] * 4


def test_the_same_scan_gives_the_same_bricks(package, tmp_path):
    light = LIT if package.manifest.on_demand.ghost == 2 else ""
    again = built(write_raw_scene(tmp_path, voxels(), TRANSFER + ON_DEMAND + light))
    for file in (package.manifest.on_demand.index, package.manifest.on_demand.bricks):
        assert again.read_bytes(file) == package.read_bytes(file)


def test_a_choice_is_the_same_again(package, bricks):
    seen = view_loss(bricks, view_of(package.manifest.grid, "left"), PIXELS)
    first, second = (choose(bricks, seen, 40, 0.0) for _ in range(2))
    assert isinstance(first, ChosenBricks)
    assert first.bound == second.bound
    assert all(np.array_equal(a, b) for a, b in zip(first.held, second.held, strict=True))
