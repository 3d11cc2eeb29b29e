"""Normals where there are no 3D textures: what mosaics hold, what their fetch gives, and how what they light looks."""

import numpy as np
import pytest
import scene_builds
from fetch import trilinear
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from mosaic_probe import planes, tolerance
from normals_probe import normals_probe
from tiny_packages import ES2, ES3, function, tiny_package

from volprep.parts.mosaic.packing import Packing, Room, fit_mosaic
from volprep.render.egl import Context
from volprep.render.gl import Gl
from volprep.scene.scene import NormalSettings
from volprep.truth.normal_codes import decoded
from volprep_formats.grid import Grid
from volprep_formats.package.parts.normals.record import DIRECTION_BYTES
from volprep_formats.textures import ktx2
from volprep_formats.textures.mosaic import slices_of_mosaic

FOG = function((0.0, (0.2, 0.4, 0.8), 0.1), (255.0, (0.9, 0.4, 0.1), 0.1))
CODES = ("biased8", "oct8", "oct12")
SIZE = 48
SPACING = (2.5, 0.7, 1.1)
lengths = st.sampled_from([1, 2, 3, 5, 7, 8, 11, 13, 17, 23, 31])
shapes = st.tuples(st.one_of(lengths, st.integers(1, 90)), lengths, lengths)
rooms = st.builds(
    Room, size=st.sampled_from([40, 64, 100, 256]), textures=st.integers(1, 6), npot=st.booleans(), square=st.booleans()
)


@pytest.fixture(scope="module")
def surface():
    with Context("es2.0") as context:
        gl = Gl(context)
        with gl.target("rgba32f", (SIZE, SIZE)) as target:
            yield gl, target
        gl.close()


@pytest.mark.long
@settings(max_examples=60)
@given(shapes, rooms, st.sampled_from(CODES), st.integers(0, 2**32 - 1))
def test_every_layout_gives_the_normals_between_voxels_or_those_of_the_voxel(surface, shape_zyx, room, code, seed):
    layout = fit_mosaic(shape_zyx, Packing(components_per_voxel=DIRECTION_BYTES[code]), room)
    assume(layout is not None)
    gl, target = surface
    rng = np.random.default_rng(seed)
    codes = rng.integers(0, 256, (*shape_zyx, layout.components_per_voxel), dtype=np.uint8)
    # The code's own zero: codes of two numbers reserve byte 0, which the encoder writes for nothing else.
    if code == "oct8":
        codes[..., :2] = np.maximum(codes[..., :2], 1)
    elif code == "oct12":
        codes[..., 0] |= 1
    extent_xyz = np.array(shape_zyx[::-1]) * SPACING[::-1]
    rounding = tolerance(layout, gl.driver)
    with normals_probe(gl, target, codes, layout, (code, SPACING)) as probe:
        for plane in planes(extent_xyz, rng):
            shown, texels = probe.plane(*plane)
            positions, found = shown.reshape(-1, 3), texels[..., :3].reshape(-1, 3)
            if code == "biased8":
                fields = [trilinear(np.ascontiguousarray(codes[..., k]), SPACING, positions) for k in range(3)]
                truth = (np.stack(fields, axis=-1) * 255 - 128) / 127
                # A component goes from -128/127 to 1, a stored value from 0 to 1.
                assert np.abs(found - truth).max() <= rounding * 255 / 127 < 1 / 255
            else:
                voxel = positions / SPACING[::-1]
                # Which of two voxels a position between them is in, float32 decides.
                clear = (np.abs(voxel - np.rint(voxel)) > rounding).all(axis=-1)
                z, y, x = (np.clip(np.floor(voxel[:, 2 - a]).astype(int), 0, shape_zyx[a] - 1) for a in range(3))
                error = np.abs(found - decoded(codes[z, y, x], code)).max(axis=-1)
                assert error[clear].max(initial=0) <= 2.0**-20


def made(folder, codes, profile, code, **other):
    wanted = NormalSettings(code=code)
    return tiny_package(folder / profile.name, codes, FOG, profile, normals=wanted, lighting="headlight", **other)


def held(package, level=0):
    textures = [each for each in package.manifest.textures if (each.role, each.level) == ("normals", level)]
    return textures, [ktx2.decode(package.read_bytes(texture.file), texture.file).data for texture in textures]


@pytest.mark.long(keep=2)
@pytest.mark.parametrize("code", CODES)
@pytest.mark.parametrize(
    ("shape", "size", "textures"),
    [((7, 16, 13), 2048, 1), ((1, 9, 5), 64, 1), ((90, 11, 10), 64, 3), ((5, 1, 1), 64, 1)],
    ids=str,
)
def test_a_mosaic_holds_the_texels_of_the_3d_texture(tmp_path, shape, size, textures, code):
    codes = np.random.default_rng(3).integers(0, 256, shape, np.uint8)
    small = ES2.model_copy(update={"max_texture_size": size})
    found, parts = held(made(tmp_path, codes, small, code))
    (flat,), (twin,) = held(made(tmp_path, codes, ES3, code))
    assert len(found) == textures
    assert [texture.part for texture in found] == list(range(textures))
    assert {texture.normals for texture in found} == {flat.normals}
    layout = found[0].mosaic
    np.testing.assert_array_equal(slices_of_mosaic([part[0] for part in parts], layout), twin)
    assert layout.components_per_voxel == twin.shape[-1]


# A tenth of a step of an 8-bit target. Positions in float32 explain more: 0.2 steps in a mosaic 300 texels wide.
EQUAL = 0.1 / 255


@pytest.mark.long(keep=3)
@pytest.mark.parametrize("code", ["biased8", "oct8", "oct12"])
@pytest.mark.parametrize("view", ["anterior", "superior", "anterior-left"])
@pytest.mark.parametrize("size", [2048, 192])
def test_a_sphere_is_lit_as_by_3d_textures(tmp_path, code, view, size):
    shape = (29, 41, 47)
    grid = Grid.of(shape, (1.4, 1.0, 0.9))
    z, y, x = ((np.arange(n) + 0.5) * h - n * h / 2 for n, h in zip(shape, grid.spacing_mm_zyx, strict=True))
    distance = np.sqrt(z[:, None, None] ** 2 + y[:, None] ** 2 + x**2)
    codes = np.clip(np.rint((16.3 - distance) * 24 + 128), 0, 255).astype(np.uint8)
    surface_of = function((110.0, (1.0, 0.8, 0.6), 0.0), (150.0, (1.0, 0.8, 0.6), 3.0))
    # The same tables on both: of eight bits.
    flat = ES3.model_copy(update={"texture_formats": tuple(f for f in ES3.texture_formats if "16float" not in f)})
    drawn = {}
    for profile in (ES2.model_copy(update={"max_texture_size": size}), flat):
        package = tiny_package(
            tmp_path / profile.name,
            codes,
            surface_of,
            profile,
            grid=grid,
            normals=NormalSettings(code=code),
            lighting="headlight",
            entries=128,
            packing=Packing(4) if size == 192 and profile is not flat else Packing(),
        )
        if profile is not flat:
            assert len(held(package)[0]) == {2048: 1, 192: 2}[size]
        drawn[profile.api] = scene_builds.drawn(package, view, (128, 128), target="rgba32f")
    lit, twin = drawn["es2.0"], drawn["es3.0"]
    assert twin[..., 0].max() > 0.9
    error = np.abs(lit - twin).max(axis=-1)
    if code == "biased8":
        assert error.max() <= EQUAL
    else:
        # Where a sample is between two voxels, float32 decides which of them it is in.
        assert (error > EQUAL).mean() <= 0.01


@pytest.mark.parametrize("classification", ["lookup", "preintegrated"])
@pytest.mark.parametrize("skip", [None, ("distance", 4)], ids=["all", "skipping"])
def test_every_way_of_classifying_and_skipping_is_lit(tmp_path, classification, skip):
    grid = Grid.of((40, 40, 40), (1.0, 1.0, 1.0))
    at = np.arange(40) - 19.5
    distance = np.sqrt(at[:, None, None] ** 2 + at[:, None] ** 2 + at**2)
    codes = np.minimum(np.rint(distance * 8), 255).astype(np.uint8)
    ramp = function((15.0, (1.0, 1.0, 1.0), 5.0), (17.0, (1.0, 1.0, 1.0), 0.0))
    pictures = []
    for profile in (ES2, ES3.model_copy(update={"texture_formats": ("r8unorm", "rgb8unorm", "rgba8unorm")})):
        package = tiny_package(
            tmp_path / profile.name,
            codes,
            ramp,
            profile,
            grid=grid,
            step_mm=0.25,
            window=(0.0, 32.0),
            classification=classification,
            skip=skip,
            normals=NormalSettings(),
            lighting="headlight",
        )
        pictures.append(scene_builds.drawn(package, "anterior", (96, 96), target="rgba32f"))
    assert pictures[1][..., 0].max() > 0.9
    assert np.abs(pictures[0] - pictures[1]).max() <= EQUAL


def test_the_text_has_only_what_the_layout_needs(tmp_path):
    codes = np.random.default_rng(4).integers(0, 256, (90, 11, 10), np.uint8)
    one = made(tmp_path / "one", codes, ES2, "biased8")
    several = made(tmp_path / "more", codes, ES2.model_copy(update={"max_texture_size": 64}), "oct12")
    slice_ = made(tmp_path / "slice", codes[:1], ES2, "biased8")
    texts = [package.read_text(package.manifest.level_programs[0].fragment) for package in (one, several, slice_)]
    assert ["unit" in text for text in texts] == [False, True, False]
    assert ["octahedron" in text or "folded" in text for text in texts] == [False, True, False]
    assert ["LAST_SLICE" in text for text in texts] == [True, True, False]
    assert all(text.startswith("#version 100\n") for text in texts)
