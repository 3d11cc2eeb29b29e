"""Pre-integrated tables and palettes as shaders draw them, against the oracle and against lookup tables."""

import gzip
import re
from itertools import pairwise

import numpy as np
import OpenImageIO
import pytest
from scene_builds import drawn, view_of
from tiny_packages import ES2, ES3, function, lossless, tiny_package

from volprep.parts.mosaic.montage import write_montage
from volprep.parts.mosaic.packing import Packing, Room
from volprep.render.renderer import Renderer
from volprep.truth.camera import standard_views
from volprep.truth.decoded import table_function
from volprep.truth.oracle import oracle_picture
from volprep.truth.picture import encoded
from volprep.truth.volume import Volume
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.package.level_texels import level_texels
from volprep_formats.package.reader import Package

SHAPE_HW = (48, 48)
GRID = Grid.of((16, 18, 20), (1.3, 0.9, 1.0), (3.0, -20.0, 7.0))
PROFILES = {
    "texture3d": ES3,
    "texture3d-rgba8": ES3.model_copy(update={"texture_formats": ("r8unorm", "rgba8unorm")}),
    "mosaic": ES2,
}
RED, GREEN, WHITE = (0.9, 0.1, 0.1), (0.1, 0.8, 0.3), (1.0, 1.0, 1.0)
STEEP = function(
    *((90.0, RED, 0.0), (90.0, RED, 1.5), (96.0, RED, 1.5), (96.0, RED, 0.0)),
    *((150.0, GREEN, 0.0), (151.0, GREEN, 3.0), (153.0, GREEN, 0.0)),
    *((200.0, WHITE, 0.0), (200.0, WHITE, 0.8)),
)
BENT = function((0.0, (0.2, 0.1, 0.9), 0.0), (90.0, RED, 0.05), (140.0, GREEN, 0.01), (255.0, WHITE, 0.4))


def waves():
    """Smooth codes whose value passes every edge of the function many times."""
    z, y, x = np.meshgrid(
        *(np.arange(n) * h for n, h in zip(GRID.shape_zyx, GRID.spacing_mm_zyx, strict=True)), indexing="ij"
    )
    field = np.sin(0.31 * x + 0.2) + np.cos(0.27 * y) + np.sin(0.23 * z - 0.4)
    return np.rint((field + 3) / 6 * 255).astype(np.uint8)


CODES = waves()


def draw(package, view, step_mm=None):
    camera = standard_views(GRID)[view]
    with Renderer(package, target="rgba32f") as renderer:
        return renderer.render(camera.box_from_clip(GRID, 1.0), SHAPE_HW, step_mm).astype(np.float64)


def oracle(transfer_function, view):
    box_from_clip = view_of(GRID, view)
    return oracle_picture(Volume(CODES, GRID), transfer_function, box_from_clip, SHAPE_HW, tolerance=1e-7).rgba


def rmse(picture, truth):
    return float(np.sqrt(np.mean((picture - truth) ** 2)))


@pytest.mark.long
@pytest.mark.parametrize("profile", PROFILES.values(), ids=PROFILES.keys())
def test_a_quarter_of_the_samples_is_enough_where_the_transfer_function_is_steep(tmp_path, profile):
    """Over the nine views, with steps from under half a voxel to nearly two."""
    views = list(standard_views(GRID))
    truth = [oracle(STEEP, view) for view in views]
    lookup = tiny_package(tmp_path / "lookup", CODES, STEEP, profile, grid=GRID)

    def error(package, step_mm):
        return rmse(np.array([draw(package, view, step_mm) for view in views]), np.array(truth))

    for step_mm in (1.6, 0.8, 0.4):
        table = tiny_package(
            tmp_path / f"{step_mm}", CODES, STEEP, profile, grid=GRID, classification="preintegrated", step_mm=step_mm
        )
        assert error(table, step_mm) < error(lookup, step_mm / 4) * 0.9
        assert error(table, step_mm) < error(lookup, step_mm) / 4


@pytest.mark.parametrize("profile", PROFILES.values(), ids=PROFILES.keys())
def test_with_short_segments_the_picture_is_the_oracles(tmp_path, profile):
    package = tiny_package(
        tmp_path / "p", CODES, BENT, profile, grid=GRID, classification="preintegrated", step_mm=0.0625, entries=2048
    )
    # Between two entries the function counts as constant: extinction is off by half of what it changes there, 0.4/mm in
    # 115 codes of 8 entries, with either sign along a ray of up to 34 mm.
    allowed = 0.4 / 115 / 8 / 2 * 34 / 4
    assert np.abs(draw(package, "posterior-left") - oracle(BENT, "posterior-left")).max() <= allowed


def test_a_table_belongs_to_no_step(tmp_path):
    texels = []
    for step_mm in (0.2, 1.9):
        folder = tmp_path / f"{step_mm}"
        package = tiny_package(folder, CODES, STEEP, grid=GRID, classification="preintegrated", step_mm=step_mm)
        (table,) = (each for each in package.manifest.textures if each.role == "preintegrated")
        texels.append(package.read_bytes(table.file))
    assert texels[0] == texels[1]


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("profile", PROFILES.values(), ids=PROFILES.keys())
@pytest.mark.parametrize("transfer_function", [STEEP, BENT], ids=["steep", "bent"])
def test_finer_segments_are_never_worse(tmp_path, profile, transfer_function):
    folder = tmp_path / "p"
    package = tiny_package(
        folder, CODES, transfer_function, profile, grid=GRID, classification="preintegrated", entries=2048
    )
    truth = oracle(transfer_function, "anterior-left")
    errors = [rmse(draw(package, "anterior-left", step_mm), truth) for step_mm in (3.2, 1.6, 0.8, 0.4, 0.2, 0.1)]
    assert all(finer <= 1.05 * coarser for coarser, finer in pairwise(errors)), errors
    assert errors[-1] < 1e-3


def test_the_last_segment_of_a_ray_ends_where_the_box_ends(tmp_path):
    constant = np.full((4, 4, 4), 128, np.uint8)
    grey = function((0.0, WHITE, 0.1), (255.0, WHITE, 0.1))
    package = tiny_package(tmp_path / "p", constant, grey, classification="preintegrated", step_mm=3.0)
    picture = drawn(package, "superior", (8, 8), target="rgba32f")
    assert picture[4, 4, 3] == pytest.approx(1 - np.exp(-0.4), abs=2.0**-12)


def test_stopped_rays_and_levels_go_with_every_classification(tmp_path):
    coarse = CODES[::2, ::2, ::2].copy()
    for name in ("preintegrated", "palette"):
        package = tiny_package(tmp_path / name, [CODES, coarse], STEEP, grid=GRID, cutoff=0.9, classification=name)
        picture = drawn(package, "left", SHAPE_HW, level=1, target="rgba32f")
        assert 0.9 <= picture[..., 3].max() <= 1.0
        assert "0.1 * pow(" in package.read_text(package.manifest.level_programs[0].fragment)


@pytest.mark.parametrize("entries", [2, 60, 256])
def test_a_palette_draws_the_steps_that_it_stands_for(tmp_path, entries):
    package = tiny_package(tmp_path / "p", CODES, BENT, grid=GRID, classification="palette", entries=entries)
    steps = table_function_of(package)
    # Steps make the error fall with the step only, whatever the rule: a step of 0.01 mm at 0.4 per mm is 0.004 deep.
    assert np.abs(draw(package, "left", 0.01) - oracle(steps, "left")).max() < 0.4 * 0.01 * 4
    assert not [texture for texture in package.manifest.textures if texture.role != "volume"]


def table_function_of(package):
    quantization = lossless()
    (channel,) = package.manifest.channels
    told = channel.model_copy(update={"quantization": quantization})
    package = type(package)(package.path, package.manifest.model_copy(update={"channels": (told,)}))
    return table_function(package, "test")


def test_classified_voxels_can_be_looked_at(tmp_path):
    codes = np.random.default_rng(4).integers(0, 256, (3, 5, 7)).astype(np.uint8)
    package = tiny_package(tmp_path / "p", codes, STEEP, classification="preclassified", step_mm=0.25)
    write_montage(package, None, tmp_path / "p.png")
    pixels = OpenImageIO.ImageInput.open(str(tmp_path / "p.png")).read_image("uint8")
    first = encoded(level_texels(package, 0)[0] / 255, "black")
    assert first.any()
    np.testing.assert_array_equal(pixels[:5, :7], first)


def test_classified_voxels_are_mixed_with_their_opacity(tmp_path):
    """A ramp between an opaque red voxel and a transparent blue one stays red, and is half as opaque in the middle."""
    step = function((0.0, (0.0, 0.0, 1.0), 0.0), (100.0, (0.0, 0.0, 1.0), 0.0), (100.0, RED, 0.2), (255.0, RED, 0.2))
    codes = np.zeros((1, 1, 8), np.uint8)
    codes[..., 4:] = 255
    package = tiny_package(tmp_path / "p", codes, step, classification="preclassified", step_mm=0.25)
    picture = drawn(package, "anterior", (64, 64), target="rgba32f")
    seen = picture[32][picture[32, :, 3] > 0.01]
    # Bytes of a colour times an opacity of 0.26: half a step of 255 is 1 % of them.
    np.testing.assert_allclose(seen[:, :3] / seen[:, 3:], np.broadcast_to(RED, (len(seen), 3)), atol=0.02)
    assert seen[:, 3].max() == pytest.approx(1 - np.exp(-0.2), abs=0.005)
    share = seen[:, 3] / seen[:, 3].max()
    assert np.count_nonzero((share > 0.2) & (share < 0.8)) >= 3, "nothing lies between the voxels"


@pytest.mark.parametrize("step_mm", [0.1, 0.4])
def test_classified_voxels_have_the_opacity_of_any_step(tmp_path, step_mm):
    constant = np.full((6, 6, 6), 200, np.uint8)
    grey = function((0.0, WHITE, 0.05), (255.0, WHITE, 0.05))
    package = tiny_package(tmp_path / "p", constant, grey, classification="preclassified", step_mm=0.4)
    picture = drawn(package, "superior", (8, 8), step_mm, target="rgba32f")
    # A byte of the opacity of 2.4 mm, 0.113: half a step is 1.7 % of the extinction.
    assert picture[4, 4, 3] == pytest.approx(1 - np.exp(-0.3), rel=0.02)
    assert package.manifest.textures[0].reference_mm == pytest.approx(2.4)


def test_classified_voxels_come_near_where_the_function_is_gentle_and_lose_what_lies_between_voxels(tmp_path):
    errors = {}
    for name, transfer_function in (("gentle", BENT), ("steep", STEEP)):
        truth = oracle(transfer_function, "anterior-right")
        for kind in ("lookup", "preclassified"):
            package = tiny_package(
                tmp_path / (name + kind), CODES, transfer_function, grid=GRID, classification=kind, step_mm=0.2
            )
            errors[name, kind] = rmse(draw(package, "anterior-right"), truth)
    assert errors["gentle", "preclassified"] < 0.01
    assert errors["steep", "preclassified"] > 4 * errors["steep", "lookup"]


def test_the_more_entries_the_nearer_is_a_palette(tmp_path):
    truth = oracle(BENT, "left")
    errors = [
        rmse(
            draw(tiny_package(tmp_path / str(n), CODES, BENT, grid=GRID, classification="palette", entries=n), "left"),
            truth,
        )
        for n in (8, 60, 256)
    ]
    assert errors == sorted(errors, reverse=True)
    assert errors[1] < 0.01 < errors[0]


def test_a_shader_holds_what_it_classifies_with_and_nothing_else(tmp_path):
    texts = {}
    for name in ("lookup", "preintegrated", "palette"):
        package = tiny_package(tmp_path / name, CODES, STEEP, grid=GRID, classification=name, entries=60)
        texts[name] = package.read_text(package.manifest.level_programs[0].fragment)
    assert [bool(re.search("PALETTE", text)) for text in texts.values()] == [False, False, True]
    assert ["End front" in text for text in texts.values()] == [False, True, False]
    assert [len(re.findall("uniform highp sampler", text)) for text in texts.values()] == [2, 2, 1]


def test_on_an_engine_half_a_voxel_does_what_takes_an_eighth_of_one_with_a_lookup_table(scans, tmp_path):
    packed = next((scans / "engine_pair" / "data").glob("*.raw.gz"))
    codes = np.frombuffer(gzip.decompress(packed.read_bytes()), np.uint8).reshape(128, 256, 256)
    grid = Grid.of(codes.shape, (1.0, 1.0, 1.0))
    edges = function(
        *((95.0, GREEN, 0.0), (97.0, GREEN, 0.25), (101.0, GREEN, 0.25), (103.0, GREEN, 0.0)),
        *((180.0, RED, 0.0), (180.0, RED, 1.5)),
    )
    matrices = [view.box_from_clip(grid, 1.0) for view in standard_views(grid).values()]
    truth = [oracle_picture(Volume(codes, grid), edges, each, (72, 72), tolerance=1e-5).rgba for each in matrices]
    errors = {}
    for name, step_mm in (("lookup", 0.125), ("preintegrated", 0.5)):
        package = tiny_package(tmp_path / name, codes, edges, grid=grid, classification=name, step_mm=step_mm)
        with Renderer(package, target="rgba32f") as renderer:
            errors[name] = rmse(np.array([renderer.render(each, (72, 72)) for each in matrices]), np.array(truth))
    assert errors["preintegrated"] < errors["lookup"] < 0.01


@pytest.mark.parametrize(
    ("name", "profile"),
    [*(("preintegrated", profile) for profile in PROFILES.values()), ("palette", ES3), ("preclassified", ES3)],
    ids=["segments", "segments-rgba8", "segments-mosaic", "palette", "preclassified"],
)
def test_every_word_of_a_shader_is_used_and_every_uniform_active(tmp_path, name, profile):
    package = tiny_package(tmp_path / "p", CODES, STEEP, profile, grid=GRID, classification=name, entries=16)
    text = package.read_text(package.manifest.level_programs[0].fragment)
    assert text.isascii()
    assert not re.search(r"\$|//#|//:", text)
    assert all(len(line) <= 120 for line in text.splitlines())
    code = re.sub(r"//.*", "", text)
    for found in re.findall(r"^(?:float|vec[234]) (\w+)\(|^const \w+ (\w+)", code, re.MULTILINE):
        word = "".join(found)
        assert len(re.findall(rf"\b{word}\b", code)) > 1, f"{word} is dead"
    # The renderer refuses a program whose active uniforms are not those that the manifest names.
    with Renderer(package):
        pass


@pytest.mark.parametrize("profile", PROFILES.values(), ids=PROFILES.keys())
@pytest.mark.parametrize(("transfer_function", "limit"), [(STEEP, 5e-3), (BENT, 1e-3)], ids=["steep", "bent"])
def test_control_points_are_the_function_itself(tmp_path, profile, transfer_function, limit):
    """A lookup table has 256 entries, and rounds to bytes or half floats; arithmetic has no entries.

    What is left of the steep one is steps that see its jumps late or early.
    """
    errors = {}
    for name in ("control-points", "lookup"):
        package = tiny_package(tmp_path / name, CODES, transfer_function, profile, grid=GRID, classification=name)
        errors[name] = rmse(draw(package, "anterior-left", 0.0625), oracle(transfer_function, "anterior-left"))
    assert errors["control-points"] < limit
    assert errors["control-points"] < errors["lookup"] / 2
    package = Package.open(tmp_path / "control-points", allow_draft=True)
    assert not any(each.role == "transfer" for each in package.manifest.textures)
    assert table_function(package, "test") == transfer_function


def test_at_a_jump_control_points_take_the_side_above(tmp_path):
    jump = function((0.0, RED, 0.1), (100.0, RED, 0.1), (100.0, GREEN, 0.5), (255.0, GREEN, 0.5))
    for code, colour, extinction in ((99, RED, 0.1), (100, GREEN, 0.5), (255, GREEN, 0.5), (0, RED, 0.1)):
        codes = np.full((4, 4, 4), code, np.uint8)
        package = tiny_package(tmp_path / f"{code}", codes, jump, classification="control-points")
        camera = view_of(package.manifest.grid, "superior")
        with Renderer(package, target="rgba32f") as renderer:
            pixel = renderer.render(camera, (1, 1))[0, 0]
        opacity = -np.expm1(-extinction * 4)
        assert pixel == pytest.approx([*np.array(colour) * opacity, opacity], abs=1e-6)


@pytest.mark.parametrize("classification", ["palette", "preclassified", "control-points"])
def test_without_3d_textures_and_tables_the_picture_is_the_same(tmp_path, classification):
    one, other = (
        tiny_package(tmp_path / name, CODES, BENT, profile, grid=GRID, classification=classification, entries=40)
        for name, profile in (("3d", PROFILES["texture3d-rgba8"]), ("2d", ES2))
    )
    difference = draw(one, "anterior-left") - draw(other, "anterior-left")
    # A sample between two entries of a palette may be on either side in one of them.
    assert rmse(difference, 0.0) < (1e-3 if classification == "palette" else 1e-5)


def test_eight_textures_hold_512_slices_on_a_device_with_eight_units(tmp_path):
    """As 2048² textures hold 512³ voxels: 16 tiles and four channels in each, and no unit is left for a table."""
    rng = np.random.default_rng(3)
    codes = np.rint(np.linspace(0, 255, 512)[:, None, None] * rng.random((1, 16, 16))).astype(np.uint8)
    profile = ES2.model_copy(update={"max_texture_size": 64})
    room = Room(64, textures=8)
    settings = {"packing": Packing(4), "room": room, "spacing_mm_zyx": (0.05, 1.0, 1.0)}
    package = tiny_package(tmp_path / "p", codes, BENT, profile, classification="control-points", **settings)
    assert profile.texture_units == 8
    assert len(package.manifest.level_programs[0].samplers) == 8
    truth = tiny_package(tmp_path / "3d", codes, BENT, spacing_mm_zyx=(0.05, 1.0, 1.0), classification="control-points")
    grid = package.manifest.grid
    camera = view_of(grid, "anterior-left")
    pictures = []
    for each in (package, truth):
        with Renderer(each, target="rgba32f") as renderer:
            pictures.append(renderer.render(camera, SHAPE_HW))
    assert np.abs(pictures[0] - pictures[1]).max() < 1e-4
    with pytest.raises(VolprepError, match="VP5013"):
        Renderer(tiny_package(tmp_path / "table", codes, BENT, profile, **settings))


def test_a_wall_behind_haze_has_no_dots_of_haze(tmp_path):
    """Between an entry of haze and one of the wall, the filter may not give the wall's opacity the colour of haze."""
    z, y, x = np.meshgrid(*(np.arange(n) + 0.5 for n in (20, 20, 20)), indexing="ij")
    ball = np.rint(12.0 * np.sqrt((x - 10) ** 2 + (y - 10) ** 2 + (z - 10) ** 2)).astype(np.uint8)
    blue, amber = (0.05, 0.1, 1.0), (1.0, 0.5, 0.2)
    wall = function((0.0, blue, 1e9), (72.0, blue, 1e9), (72.0, amber, 0.02), (255.0, amber, 0.02))
    grid = Grid.of(ball.shape, (1.0, 1.0, 1.0))
    package = tiny_package(tmp_path / "p", ball, wall, grid=grid, classification="preintegrated", step_mm=1.0)
    view = view_of(grid, "anterior")
    truth = oracle_picture(Volume(ball, grid), wall, view, (64, 64)).rgba
    with Renderer(package, target="rgba32f") as renderer:
        for step_mm in (1.0, 0.25):
            picture = renderer.render(view, (64, 64), step_mm)
            on_wall = truth[..., 2] > 0.6
            assert on_wall.sum() > 200
            # Silhouettes are seen late or early; a dot of haze has little blue in the midst of the wall.
            assert (picture[on_wall][:, 2] > 0.5).mean() > 0.995
