"""Pictures against the oracle, against each other, and how the error falls with the step."""

import numpy as np
import pytest
from scene_builds import view_of
from tiny_packages import ES2, ES3, function, tiny_package

from volprep.parts.mosaic.packing import Packing, Room
from volprep.render.renderer import Renderer
from volprep.truth.camera import standard_views
from volprep.truth.convergence import fit_order
from volprep.truth.oracle import oracle_picture
from volprep.truth.volume import Volume
from volprep_formats.grid import Grid

SHAPE_HW = (40, 40)
LAYOUTS = [(ES3, 1), (ES2, 1), (ES2, 4)]
ES3_BYTES = ES3.model_copy(update={"texture_formats": ("r8unorm", "rgba8unorm")})
# Linear from the first to the last code: a table of two entries, 0 and 1, holds it exactly in every format but for the
# root of extinction in RGBA8, which is why that is compared with itself only.
LINEAR = function((0.0, (0.0, 0.0, 1.0), 0.0), (255.0, (1.0, 0.0, 0.0), 0.5))
BENT = function(
    (0.0, (0.2, 0.1, 0.9), 0.0),
    (90.0, (1.0, 0.1, 0.1), 0.05),
    (140.0, (0.1, 0.9, 0.4), 0.01),
    (255.0, (1.0, 1.0, 1.0), 0.4),
)


def smooth_codes(shape_zyx, seed=11):
    """Random codes, blurred over neighbours."""
    codes = np.random.default_rng(seed).random(shape_zyx)
    for axis in range(3):
        padded = np.pad(codes, [(1, 1) if a == axis else (0, 0) for a in range(3)], mode="edge")
        codes = sum(np.take(padded, np.arange(n, n + shape_zyx[axis]), axis) for n in range(3)) / 3
    codes = (codes - codes.min()) / (codes.max() - codes.min())
    return np.rint(codes * 255).astype(np.uint8)


GRID = Grid.of((9, 11, 10), (1.4, 0.8, 1.1), (3.0, -20.0, 7.0))
CODES = smooth_codes(GRID.shape_zyx)


def draw(package, grid, view, step_mm=None, projection="orthographic", **settings):
    camera = standard_views(grid, projection)[view]
    with Renderer(package, target="rgba32f", **settings) as renderer:
        return renderer.render(camera.box_from_clip(grid, 1.0), SHAPE_HW, step_mm).astype(np.float64)


def oracle(codes, grid, transfer_function, view, projection="orthographic"):
    box_from_clip = view_of(grid, view, projection)
    return oracle_picture(Volume(codes, grid), transfer_function, box_from_clip, SHAPE_HW, tolerance=1e-8).rgba


def rms_error(package, step_mm, view, projection="orthographic"):
    truth = oracle(CODES, GRID, LINEAR, view, projection)
    return float(np.sqrt(np.mean((draw(package, GRID, view, step_mm, projection) - truth) ** 2)))


def test_the_error_against_the_oracle_falls_with_the_square_of_the_step(tmp_path):
    """Along z, where half voxels are whole numbers of steps: no segment holds a kink of the trilinear field."""
    package = tiny_package(tmp_path / "p", CODES, LINEAR, grid=GRID, entries=2)
    # A little more than half a voxel of 1.4 mm, so that rounding does not add a segment.
    steps = [0.7001 / 2**k for k in range(6)]
    errors = [rms_error(package, step, "superior") for step in steps]
    settled = fit_order(steps, errors, floor=2e-7)
    assert settled.order == pytest.approx(2.0, abs=0.15), errors
    assert settled.last - settled.first >= 3


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_in_oblique_views_the_error_falls_as_fast_down_to_what_float32_leaves(tmp_path, projection):
    """Kinks fall anywhere in a segment, so that single refinements gain from 2 to 8; four of them gain 4 on average."""
    package = tiny_package(tmp_path / "p", CODES, LINEAR, grid=GRID, entries=2)
    coarse, fine = (rms_error(package, step, "anterior-right", projection) for step in (1.6, 0.1))
    assert np.log2(coarse / fine) / 4 == pytest.approx(2.0, abs=0.3)


@pytest.mark.parametrize(("profile", "channels"), LAYOUTS, ids=["texture3d", "mosaic-scan-1", "mosaic-scan-4"])
@pytest.mark.parametrize("view", ["left", "inferior", "posterior-left"])
def test_pictures_agree_with_the_oracle(tmp_path, profile, channels, view):
    package = tiny_package(tmp_path / "p", CODES, BENT, profile, grid=GRID, packing=Packing(channels))
    truth = oracle(CODES, GRID, BENT, view)
    # Bytes: colour is off by 0.5 / 255, extinction by (2 · 0.5 / 255) of its largest, 0.4 per mm, on paths of up to
    # 17 mm; half floats by 2^-12 of each. Midpoint at 0.05 mm adds less than either.
    error = np.abs(draw(package, GRID, view, 0.0625) - truth).max()
    assert error <= (0.5 / 255 + 0.4 / 255 * 17 if profile is ES2 else 2.0**-12 * (1 + 0.4 * 17))


@pytest.mark.long(keep=4)
@pytest.mark.parametrize("tiles", [100, 1], ids=["in-one", "in-several"])
@pytest.mark.parametrize(
    "packing",
    [Packing(), Packing(gutter=1), Packing(4), Packing(4, "planar", 1), Packing(4, "overlapping")],
    ids=["one-channel", "gutter", "interleaved", "planar-gutter", "overlapping"],
)
@pytest.mark.parametrize("view", ["right", "anterior-left"])
def test_mosaic_and_3d_texture_give_the_same_picture(tmp_path, packing, view, tiles):
    """A value that is off by e changes a picture by at most e (colour' + 2 · extinction' · path), here 14 e."""
    one = tiny_package(tmp_path / "3d", CODES, BENT, ES3_BYTES, grid=GRID)
    room = Room(26 if packing.slices_per_texel == 1 and tiles == 1 else 13 * tiles, textures=7)
    other = tiny_package(tmp_path / "2d", CODES, BENT, ES2, grid=GRID, packing=packing, room=room)
    assert (len(other.manifest.textures) > 2) == (tiles == 1)
    difference = draw(one, GRID, view) - draw(other, GRID, view)
    steepest = 255 * np.abs(
        np.diff([p.extinction_per_mm for p in BENT.points]) / np.diff([p.value for p in BENT.points])
    )
    value_error = 2 * 3 * 8 * 44 * 2.0**-24
    assert np.abs(difference).max() <= value_error * (255 * 0.9 / 50 + 2 * steepest.max() * 22)


def test_a_coarse_level_of_odd_sizes_lies_where_its_grid_says(tmp_path):
    coarse_grid = GRID.coarser((2, 2, 2))
    assert coarse_grid.shape_zyx == (5, 6, 5)
    coarse = smooth_codes(coarse_grid.shape_zyx, seed=5)
    package = tiny_package(tmp_path / "p", [CODES, coarse], LINEAR, grid=GRID, entries=2)
    for view in ("superior", "posterior-left"):
        error = np.abs(draw(package, GRID, view, 0.02, level=1) - oracle(coarse, coarse_grid, LINEAR, view))
        assert error.max() < 1e-4
        assert np.abs(draw(package, GRID, view, 0.02, level=0) - oracle(CODES, GRID, LINEAR, view)).max() < 1e-4


def test_16_bit_codes_give_the_same_picture_as_their_field(tmp_path):
    codes = (CODES.astype(np.uint16) * 257)[:, ::-1].copy()
    package = tiny_package(tmp_path / "p", codes, LINEAR, grid=GRID, entries=2)
    truth = oracle(codes[...], GRID, function((0.0, (0, 0, 1), 0.0), (65535.0, (1, 0, 0), 0.5)), "anterior-left")
    error = np.abs(draw(package, GRID, "anterior-left", 0.02) - truth).max()
    # Values are off by 2^-12: colour by as much, depth by half of that on each of 17 mm.
    assert error <= 2.0**-12 * (1 + 0.5 * 17)


@pytest.mark.parametrize("cutoff", [0.5, 0.9, 0.995])
def test_what_a_stopped_ray_misses_is_at_most_what_the_cutoff_leaves(tmp_path, cutoff):
    opaque = function((0.0, (1.0, 0.5, 0.0), 0.0), (255.0, (0.0, 0.5, 1.0), 3.0))
    whole = draw(tiny_package(tmp_path / "whole", CODES, opaque, grid=GRID), GRID, "anterior-left")
    stopped = draw(tiny_package(tmp_path / "cut", CODES, opaque, grid=GRID, cutoff=cutoff), GRID, "anterior-left")
    difference = np.abs(whole - stopped)
    assert difference.max() <= 1 - cutoff + 2.0**-22
    assert difference.max() > 2.0**-22, "no ray was stopped"
    ended = stopped[..., 3] == 1.0
    assert (whole[~ended, 3] < cutoff).all()
    assert (whole[ended, 3] >= cutoff).all()
    assert (stopped[..., :3] <= stopped[..., 3:] + 2.0**-22).all()


@pytest.mark.parametrize(("target", "error"), [("rgba8", 0.5 / 255), ("rgba16f", 2.0**-11), ("rgba32f", 0.0)])
def test_a_target_rounds_the_picture_to_its_precision(tmp_path, target, error):
    package = tiny_package(tmp_path / "p", CODES, BENT, grid=GRID)
    box_from_clip = view_of(GRID, "anterior-left")
    exact = draw(package, GRID, "anterior-left")
    with Renderer(package, target=target) as renderer:
        picture = renderer.render(box_from_clip, SHAPE_HW)
    assert picture.dtype == np.float32
    # Drivers may cut a half float off instead of rounding it. 2^-16: Mesa's conversion to 8 bits.
    assert np.abs(picture - exact).max() <= error + 2.0**-16 * (target == "rgba8")
