"""What the generated fetch of every layout samples, against the trilinear field in float64."""

from contextlib import contextmanager

import numpy as np
import pytest
from fetch import away_from_faces, nearest, trilinear
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from mosaic_probe import fetch_text, mosaic_probe, planes, tolerance

from volprep.parts.mosaic.packing import Packing, Room, fit_mosaic, pack_mosaic
from volprep.render.egl import Context
from volprep.render.gl import Gl
from volprep_formats.textures.mosaic import slices_of_mosaic

SIZE = 48
SPACING = (2.5, 0.7, 1.1)
lengths = st.sampled_from([1, 2, 3, 4, 5, 7, 8, 11, 13, 16, 17, 23, 31, 37])
shapes = st.tuples(st.one_of(lengths, st.integers(1, 120)), lengths, lengths)
packings = st.one_of(
    st.builds(Packing, st.just(1), gutter=st.integers(0, 2), components_per_voxel=st.integers(1, 4)),
    st.builds(Packing, st.just(4), st.sampled_from(["interleaved", "planar", "overlapping"]), gutter=st.integers(0, 2)),
)
rooms = st.builds(
    Room,
    size=st.sampled_from([16, 40, 64, 100, 256]),
    textures=st.integers(1, 8),
    npot=st.booleans(),
    square=st.booleans(),
)


@contextmanager
def drawing(shape_hw):
    with Context("es2.0") as context:
        gl = Gl(context)
        with gl.target("rgba32f", shape_hw) as target:
            yield gl, target
        gl.close()


@pytest.fixture(scope="module")
def surface():
    """One context for all examples: making one takes longer than drawing."""
    with drawing((SIZE, SIZE)) as made:
        yield made


def truth(volume, positions):
    channels = volume[..., None] if volume.ndim == 3 else volume
    return np.stack(
        [trilinear(channel, SPACING, positions.reshape(-1, 3)) for channel in np.moveaxis(channels, -1, 0)], axis=-1
    ).reshape(*positions.shape[:-1], -1)


def sampled(found, components):
    """The components among red, green, blue and alpha as a texture of so many channels gives them."""
    return found[..., {1: [0], 2: [0, 3], 3: [0, 1, 2], 4: [0, 1, 2, 3]}[components]]


@pytest.mark.long
@settings(max_examples=150)
@given(shapes, packings, rooms, st.integers(0, 2**32 - 1))
def test_every_layout_gives_the_trilinear_field_up_to_the_borders_and_the_codes_at_voxels(
    surface, shape_zyx, packing, room, seed
):
    layout = fit_mosaic(shape_zyx, packing, room)
    assume(layout is not None)
    gl, target = surface
    rng = np.random.default_rng(seed)
    volume = rng.integers(0, 256, (*shape_zyx, packing.components_per_voxel), dtype=np.uint8)
    volume = volume[..., 0] if packing.components_per_voxel == 1 else volume
    extent_xyz = np.array(shape_zyx[::-1]) * SPACING[::-1]
    limit = tolerance(layout, gl.driver)
    assert limit < 1 / 255
    with mosaic_probe(gl, target, volume, layout, SPACING) as probe:
        for plane in planes(extent_xyz, rng):
            positions, found = probe.plane(*plane)
            error = np.abs(sampled(found, packing.components_per_voxel) - truth(volume, positions)).max(axis=-1)
            # Rays stay inside the box; there gutters are wide enough.
            inside = ((positions >= 0) & (positions <= extent_xyz)).all(axis=-1)
            assert error[inside | (layout.gutter == 0)].max(initial=0) <= limit
        for k in {0, layout.slices // 2, layout.slices - 1}:
            corner, right, up = np.zeros((3, 3))
            corner[2], right[0], up[1] = (k + 0.5) * SPACING[0], SIZE * SPACING[2], SIZE * SPACING[1]
            _, found = probe.plane(corner, right, up)
            height, width = (min(n, SIZE) for n in shape_zyx[1:])
            codes = np.rint(sampled(found, packing.components_per_voxel) * 255)[::-1][:height, :width]
            np.testing.assert_array_equal(codes.reshape(volume[k, :height, :width].shape), volume[k, :height, :width])


@settings(max_examples=50)
@given(shapes, packings.filter(lambda packing: packing.components_per_voxel == 1), rooms, st.integers(0, 2**32 - 1))
def test_every_layout_of_labels_gives_the_voxel_that_a_position_is_in(surface, shape_zyx, packing, room, seed):
    layout = fit_mosaic(shape_zyx, packing, room)
    assume(layout is not None)
    rng = np.random.default_rng(seed)
    volume = rng.integers(0, 256, shape_zyx, dtype=np.uint8)
    extent_xyz = np.array(shape_zyx[::-1]) * SPACING[::-1]
    with mosaic_probe(*surface, volume, layout, SPACING, between="nearest") as probe:
        for plane in planes(extent_xyz, rng):
            positions, found = probe.plane(*plane)
            inside = ((positions >= 0) & (positions <= extent_xyz)).all(axis=-1)
            sure = away_from_faces(shape_zyx, SPACING, positions) & (inside | (layout.gutter == 0))
            expected = nearest(volume, SPACING, positions)
            np.testing.assert_array_equal(np.rint(found[sure, 0] * 255), np.rint(expected[sure] * 255))


def test_labels_take_one_fetch_whatever_the_order():
    for order in ("interleaved", "planar", "overlapping"):
        layout = fit_mosaic((40, 9, 9), Packing(4, order), Room(64, 8))
        assert layout is not None
        text = fetch_text(layout, SPACING, "nearest")
        assert text.count("tile_texel(") == 2  # the function, and one call
        assert "mix(" not in text
    single = fit_mosaic((40, 9, 9), Packing(), Room(64, 8))
    assert single is not None
    assert [word for word in ("mix(", "dot(", "equal(") if word in fetch_text(single, SPACING, "nearest")] == []


@pytest.mark.parametrize("block", [4, 5, 6, 8])
@pytest.mark.parametrize("gutter", [0, 1])
@pytest.mark.parametrize("shape_zyx", [(7, 13, 9), (5, 16, 11), (1, 5, 7)])
def test_tiles_padded_to_blocks_give_the_trilinear_field_too(surface, shape_zyx, gutter, block):
    layout = fit_mosaic(shape_zyx, Packing(gutter=gutter, block=block), Room(256))
    gl, target = surface
    rng = np.random.default_rng(block)
    volume = rng.integers(0, 256, shape_zyx, dtype=np.uint8)
    extent_xyz = np.array(shape_zyx[::-1]) * SPACING[::-1]
    texels = np.concatenate(list(pack_mosaic(lambda z0, z1: volume[z0:z1], layout)))[..., 0]
    np.testing.assert_array_equal(slices_of_mosaic([texels], layout), volume)
    with mosaic_probe(gl, target, volume, layout, SPACING) as probe:
        for plane in planes(extent_xyz, rng):
            positions, found = probe.plane(*plane)
            inside = ((positions >= 0) & (positions <= extent_xyz)).all(axis=-1)
            error = np.abs(sampled(found, 1) - truth(volume, positions)).max(axis=-1)
            assert error[inside | (gutter == 0)].max(initial=0) <= tolerance(layout, gl.driver)


@pytest.mark.parametrize(
    ("shape_zyx", "packing", "textures", "absent"),
    [
        ((40, 9, 9), Packing(), 1, ["dot(", "unit", "GUTTER"]),
        ((20, 9, 9), Packing(gutter=1), 1, ["dot(", "unit", "clamp(at,"]),
        ((40, 9, 9), Packing(4), 1, ["unit", "GUTTER"]),
        ((40, 9, 9), Packing(4, "overlapping"), 1, ["unit", "if ("]),
        ((40, 9, 9), Packing(4, "planar"), 1, ["unit", "if ("]),
        ((300, 9, 9), Packing(), 8, ["dot("]),
        ((1, 9, 9), Packing(), 1, ["dot(", "unit", "LAST_SLICE", "mix("]),
    ],
    ids=str,
)
def test_the_text_has_only_what_the_layout_needs(shape_zyx, packing, textures, absent):
    layout = fit_mosaic(shape_zyx, packing, Room(64, textures))
    assert layout is not None
    text = fetch_text(layout, SPACING)
    assert [word for word in absent if word in text] == []
    assert text.count("uniform highp sampler2D") == layout.textures
    assert ("unit_tile_texel" in text) == (layout.textures > 1)


PRINTED = """
vec4 printed(vec3 volpos) {
  float s1 = floor(volpos.z * numberOfSlices);
  float s2 = s1 + 1.0;
  float dx1 = fract(s1 / slicesOverX);
  float dy1 = floor(s1 / slicesOverY) / slicesOverY;
  float dx2 = fract(s2 / slicesOverX);
  float dy2 = floor(s2 / slicesOverY) / slicesOverY;
  vec2 tp1 = vec2(dx1 + volpos.x / slicesOverX, dy1 + volpos.y / slicesOverY);
  vec2 tp2 = vec2(dx2 + volpos.x / slicesOverX, dy2 + volpos.y / slicesOverY);
  return mix(texture2D(u_volume, tp1), texture2D(u_volume, tp2), volpos.z * numberOfSlices - s1);
}
void main() { gl_FragColor = printed(position(v_near.xyz / v_near.w) / vec3(PITCH, numberOfSlices)); }
"""


@pytest.mark.parametrize(("tiles_x", "tiles_y", "wrong"), [(16, 12, 0.87), (32, 8, 0.95), (10, 10, 0.0)])
def test_the_published_fetch_takes_rows_for_columns_where_ours_holds(surface, tiles_x, tiles_y, wrong):
    """Congote et al.'s listing, as the mobile volume rendering thesis prints it. Square grids hide the error."""
    gl, target = surface
    slices = tiles_x * tiles_y
    volume = np.random.default_rng(6).integers(0, 256, (slices, 5, 5), dtype=np.uint8)
    square = fit_mosaic(volume.shape, Packing(), Room(256))
    assert square is not None
    layout = square.model_copy(
        update={"tiles_x": tiles_x, "tiles_y": tiles_y, "texture_shape_yx": (5 * tiles_y, 5 * tiles_x)}
    )
    names = {"numberOfSlices": slices, "slicesOverX": tiles_x, "slicesOverY": tiles_y}
    constants = "".join(f"const float {name} = {value}.0;\n" for name, value in names.items())
    text = fetch_text(layout, (1.0, 1.0, 1.0)) + constants + PRINTED
    # Along z through the centre of a voxel, and through slices' centres as the listing has them, half a slice off.
    column = np.array([0.0, 0.0, slices / SIZE])
    plane = (np.array([2.5, 2.5, 0.0]), column, column * (SIZE - 1))
    with mosaic_probe(gl, target, volume, layout, (1.0, 1.0, 1.0), text) as probe:
        positions, printed = probe.plane(*plane)
    with mosaic_probe(gl, target, volume, layout, (1.0, 1.0, 1.0)) as probe:
        _, ours = probe.plane(*plane)
    exact = trilinear(volume, (1.0, 1.0, 1.0), positions.reshape(-1, 3)).reshape(SIZE, SIZE)
    half_off = positions.reshape(-1, 3) + np.array([0, 0, 0.5])
    shifted = trilinear(volume, (1.0, 1.0, 1.0), half_off).reshape(SIZE, SIZE)
    assert np.abs(ours[..., 0] - exact).max() <= tolerance(layout, gl.driver)
    # Half a slice off everywhere; and beyond that, in the wrong row.
    assert np.mean(np.abs(printed[..., 0] - exact) > 1 / 255) > 0.9
    in_wrong_row = np.abs(printed[..., 0] - shifted)[positions[..., 2] < slices - 1] > 1 / 255
    assert in_wrong_row.mean() >= wrong
    assert wrong or in_wrong_row.mean() < 0.02


@pytest.mark.long
def test_512_cubed_voxels_in_eight_textures_of_2048_squared_and_four_channels():
    """The published claim, with nothing to spare: eight units, clamped, no transfer function."""
    layout = fit_mosaic((512, 512, 512), Packing(4), Room(2048, 8))
    assert layout is not None
    assert (layout.textures, layout.texture_shape_yx, layout.tiles_x, layout.tiles_y) == (8, (2048, 2048), 4, 4)
    y, x = np.ogrid[:512, :512]
    # No two slices are alike, nor two texels of a tile's row or column.
    plane, volume = 37 * x + 61 * y + ((x * y) >> 6), np.empty((512, 512, 512), np.uint8)
    for z in range(512):
        volume[z] = (plane + 101 * z + ((y * z) >> 7)) & 255
    rng = np.random.default_rng(8)
    with drawing((512, 512)) as (gl, target), mosaic_probe(gl, target, volume, layout, (1.0, 1.0, 1.0)) as probe:
        # Every texture and channel; the first and the last slice; both ends of a tile's four slices and of a texture.
        for k in [0, 1, 2, 3, 4, 63, 64, 127, 130, 191, 196, 255, 257, 319, 322, 383, 384, 447, 448, 509, 510, 511]:
            corner, right, up = np.array([[0, 0, k + 0.5], [512, 0, 0], [0, 512, 0]], dtype=float)
            _, found = probe.plane(corner, right, up)
            np.testing.assert_array_equal(np.rint(found[::-1, :, 0] * 255), volume[k])
        for _ in range(2):
            corner, right, up = rng.random((3, 3)) * 512
            positions, found = probe.plane(corner, right - corner, up - corner)
            exact = trilinear(volume, (1.0, 1.0, 1.0), positions.reshape(-1, 3)).reshape(512, 512)
            assert np.abs(found[..., 0] - exact).max() <= tolerance(layout, gl.driver) < 1 / 255
