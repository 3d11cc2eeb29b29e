"""The plan's decisions, on sources that are told apart by one thing each."""

import math
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from plans import PlanOfOne, plan_of_one

from volprep.parts.layout.decision import fit_level
from volprep.parts.levels.decision import candidate_levels
from volprep.plan.records import LevelPlan
from volprep.plan.room import Beside, texture_bytes
from volprep.scan.statistics import SlabMeasurer
from volprep.scene.profiles import load_profile
from volprep.scene.scene import MosaicSettings, Scene
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.source import SourceInfo

GLES3 = load_profile("gles3", Path())
GLES2 = load_profile("gles2-2048", Path())
NORM16 = load_profile("gles3-norm16", Path())
RAMP = ((100.0, 0.0), (200.0, 0.5))


def scene(points: Sequence[tuple[float, float]] = RAMP, **tables) -> Scene:
    """Scene of one transfer function, given as (value, extinction)."""
    transfer = {"name": "a", "points": [{"value": v, "colour": "#ff8040", "extinction_per_mm": e} for v, e in points]}
    return Scene.model_validate({"name": "s", "source": {"path": "x"}, "transfer": [transfer], **tables})


def plan(voxels: np.ndarray, wanted: Scene | None = None, profile=GLES3, *, slope=1.0, intercept=0.0) -> PlanOfOne:
    """Plan for a volume in memory."""
    info = SourceInfo(
        format="raw",
        grid=Grid.of(voxels.shape, (1.0, 1.0, 1.0)),
        stored_type=voxels.dtype.name,
        slope=slope,
        intercept=intercept,
    )
    gauge = SlabMeasurer(info)
    gauge.add(voxels)
    return plan_of_one(wanted or scene(), profile, info, gauge.result("0" * 64))


def item(decided: PlanOfOne, name: str):
    return next(each for each in decided.items if each.name == name)


def noise(shape=(9, 10, 11), high=256, dtype=np.uint8) -> np.ndarray:
    return np.random.default_rng(3).integers(0, high, shape).astype(dtype)


class TestBitsAndWindow:
    def test_bytes_keep_their_values(self) -> None:
        decided = plan(noise())
        assert decided.quantize.bits == 8
        assert decided.quantize.window == (0.0, 255.0)
        assert "its own code" in item(decided, "8-bit values").reason

    def test_few_values_of_a_wide_type_are_exact_codes(self) -> None:
        # 101 values, each two codes after the one before.
        voxels = noise(high=101, dtype=np.int16)
        voxels.flat[:2] = 0, 100
        decided = plan(voxels, slope=0.5, intercept=-10.0, wanted=scene([(0.0, 0.0), (30.0, 0.4)]))
        assert decided.quantize.window == (-10.0, -10.0 + 127.5 * 0.5)

    def test_twelve_used_bits_become_eight_where_the_loss_is_below_the_tolerance(self) -> None:
        decided = plan(noise(high=4096, dtype=np.uint16), scene([(500.0, 0.0), (4000.0, 0.05)]))
        assert decided.quantize.bits == 8
        assert item(decided, "16-bit values").reason == "8 bits are enough"
        assert item(decided, "16-bit values").size_bytes == sum(math.prod(level.shape_zyx) for level in decided.levels)

    def test_they_become_sixteen_where_people_would_see_the_loss(self) -> None:
        points, voxels = [(500.0, 0.0), (4000.0, 0.05)], noise(high=4096, dtype=np.uint16)
        decided = plan(voxels, scene(points, tolerance={"flip": 1e-4}))
        assert decided.quantize.bits == 16
        assert item(decided, "16-bit values").reason.endswith("for FLIP, RMSE 1.3e-05 unlit")

    def test_they_become_sixteen_where_it_is_not(self) -> None:
        # Everything between the smallest and the largest value is told apart, and steeply at both ends.
        points = [(0.0, 0.0), (3.0, 5.0), (6.0, 0.0), (4089.0, 0.0), (4092.0, 5.0), (4095.0, 0.0)]
        decided = plan(noise(high=4096, dtype=np.uint16), scene(points))
        assert decided.quantize.bits == 16
        assert decided.volumes[0].format == "r16float"
        assert "8 bits would change" in item(decided, "16-bit values").reason
        assert "profile gles3 has no R16, and half floats change a value by" in item(decided, "16-bit values").reason

    def test_a_profile_with_exact_16_bits_gets_them_without_the_error_of_half_floats(self) -> None:
        # A ramp, which a table of any length holds exactly: what is left is the error of the texels.
        points = [(0.0, 0.0), (65535.0, 0.2)]
        voxels = noise((9, 40, 40), 65536, np.uint16)
        voxels.flat[:2] = 0, 65535
        half, exact = (plan(voxels, scene(points, quantize={"bits": 16}), each) for each in (GLES3, NORM16))
        assert {volume.format for volume in half.volumes} == {"r16float"}
        assert {volume.format for volume in exact.volumes} == {"r16unorm"}
        as_they_are = "R16 texels hold codes unchanged; they change the sample of rays by nothing"
        assert as_they_are in item(exact, "16-bit values").reason
        assert "they change the sample of rays by RMSE" in item(half, "16-bit values").reason

    def test_a_profile_with_exact_16_bits_but_no_3d_textures_has_half_floats(self) -> None:
        formats = ("r8unorm", "rgba8unorm", "r16unorm", "r16float", "rgba16float")
        flat = NORM16.model_copy(update={"max_3d_texture_size": 0, "texture_formats": formats})
        decided = plan(noise(high=4096, dtype=np.uint16), scene(quantize={"bits": 16}), flat)
        assert {volume.format for volume in decided.volumes} <= {"r16float", "rgba16float"}

    def test_a_profile_without_16_bits_gets_8_all_the_same(self) -> None:
        points = [(0.0, 0.0), (3.0, 5.0), (6.0, 0.0), (4089.0, 0.0), (4092.0, 5.0), (4095.0, 0.0)]
        decided = plan(noise(high=4096, dtype=np.uint16), scene(points), GLES2)
        assert decided.quantize.bits == 8
        assert "profile gles2-2048 has no texture format" in item(decided, "16-bit values").reason

    def test_asking_a_profile_for_bits_that_it_does_not_have_is_an_error(self) -> None:
        formats = "r8unorm, rg8unorm, rgb8unorm, rgba8unorm"
        with pytest.raises(VolprepError, match=f"VP3020 profile gles2-2048 .* 16 bits, only {formats}"):
            plan(noise(), scene(quantize={"bits": 16}), GLES2)

    def test_a_window_without_width_is_an_error(self) -> None:
        with pytest.raises(VolprepError, match=r"VP3021 the window from 9.0 to 9.0"):
            plan(noise(), scene(quantize={"window": [9.0, 9.0]}))

    def test_the_window_of_the_scene_is_taken_as_it_is(self) -> None:
        decided = plan(noise(), scene(quantize={"window": [50.0, 250.0], "bits": 16}))
        assert decided.quantize.window == (50.0, 250.0)
        assert decided.quantize.bits == 16

    def test_outliers_do_not_stretch_the_window(self) -> None:
        voxels = noise(dtype=np.float32)
        voxels[0, 0, 0] = 1e6
        low, high = plan(voxels, scene([(100.0, 0.0), (200.0, 0.5)])).quantize.window
        assert low <= 100.0
        assert 200.0 <= high <= 300.0

    def test_a_thin_stack_is_clipped_only_if_codes_do_not_suffice_otherwise(self) -> None:
        ramp = np.broadcast_to(np.linspace(0, 30000, 60), (3, 60, 60)).astype(np.int16)
        seen = scene([(1000.0, 0.0), (3000.0, 0.5)])
        assert plan(np.tile(ramp, (20, 1, 1)), seen).quantize.window[1] < 30000
        assert plan(ramp, seen).quantize.window == (0.0, 30000.0)
        outlier = ramp.astype(np.float32)
        outlier[0, 0, 0] = -1e9
        assert plan(outlier, seen).quantize.window[0] > -1e9

    def test_the_window_reaches_over_all_transfer_functions(self) -> None:
        first, second = scene([(0.1, 0.0), (0.2, 0.5)]), scene([(0.6, 0.0), (0.9, 0.5)])
        other = second.transfer[0].model_copy(update={"name": "other"})
        both = first.model_copy(update={"transfer": (*first.transfer, other)})
        voxels = np.random.default_rng(1).random((9, 9, 9)).astype(np.float32) * 1000
        voxels[2:7, 2:7, 2:7] /= 1000
        low, high = plan(voxels, both).quantize.window
        assert low <= 0.1
        assert high >= 0.9

    @pytest.mark.parametrize("value", [0, 17, -3])
    def test_a_constant_volume_has_a_window(self, value) -> None:
        low, high = plan(np.full((4, 4, 4), value, np.int16)).quantize.window
        assert low == value
        assert high > low

    def test_a_constant_volume_of_huge_values_has_a_window(self) -> None:
        low, high = plan(np.full((2, 2, 2), 3e38, np.float32)).quantize.window
        assert low < high < math.inf


class TestLevels:
    @pytest.mark.parametrize(
        ("shape", "spacing", "coarsest", "expected"),
        [
            ((9, 10, 11), (1, 1, 1), 64, [(1, 1, 1)]),
            ((384, 384, 274), (0.67, 0.67, 0.7), 64, [(1, 1, 1), (2, 2, 2), (4, 4, 4), (8, 8, 8)]),
            # Slices far apart: x and y are halved alone until the voxels are cubes.
            ((30, 512, 512), (4, 1, 1), 64, [(1, 1, 1), (1, 2, 2), (1, 4, 4), (2, 8, 8)]),
            # One slice cannot get thinner.
            ((1, 130, 65), (1, 1, 1), 20, [(1, 1, 1), (1, 2, 2), (1, 4, 4), (1, 8, 8)]),
            # The slices of a thin stack stay apart, as long as another axis can get shorter.
            ((3, 200, 150), (1, 1, 1), 64, [(1, 1, 1), (1, 2, 2), (1, 4, 4)]),
            ((3, 12, 12), (0.1, 1, 1), 2, [(1, 1, 1), (1, 2, 2), (1, 4, 4), (1, 8, 8), (1, 16, 16), (2, 16, 16)]),
            ((1, 1, 1), (1, 1, 1), 1, [(1, 1, 1)]),
            ((7, 1, 1), (9, 1, 1), 1, [(1, 1, 1), (2, 1, 1), (4, 1, 1), (8, 1, 1)]),
            # A voxel stands for no more than 2^21: kernels need its block whole.
            ((16385, 300, 300), (1, 1, 1), 1, [(2**k,) * 3 for k in range(8)]),
        ],
    )
    def test_axes_are_halved_until_the_longest_is_short_enough(self, shape, spacing, coarsest, expected) -> None:
        levels = candidate_levels("scan", Grid.of(shape, spacing), coarsest, GLES3)
        assert [level.factors_zyx for level in levels] == expected
        assert all(
            level.shape_zyx == tuple(-(-n // f) for n, f in zip(shape, level.factors_zyx, strict=True))
            for level in levels
        )

    def test_for_a_mosaic_one_axis_at_a_time_is_halved(self) -> None:
        levels = candidate_levels("scan", Grid.of((384, 384, 274), (0.67, 0.67, 0.7)), 192, GLES2)
        assert [level.factors_zyx for level in levels] == [(1, 1, 1), (2, 1, 1), (2, 2, 1), (2, 2, 2)]
        # Slices far apart stay as they are until the voxels are cubes.
        levels = candidate_levels("scan", Grid.of((30, 256, 256), (4, 1, 1)), 64, GLES2)
        assert [level.factors_zyx for level in levels] == [(1, 1, 1), (1, 2, 1), (1, 2, 2), (1, 4, 2), (1, 4, 4)]

    @pytest.mark.parametrize(
        ("asked", "is_lit"),
        [({}, True), ({"filter": "refined"}, True), ({"filter": "appearance"}, False), ({"refine": "none"}, False)],
    )
    def test_levels_are_refined_through_lit_rays_where_the_scene_leaves_their_filter_open(self, asked, is_lit) -> None:
        decided = plan(noise((33, 20, 7)), scene(pyramid={"coarsest_longest_axis": 9, **asked}))
        assert [level.lit for level in decided.levels] == [level.index > 0 and is_lit for level in decided.levels]

    def test_3d_textures_hold_every_level(self) -> None:
        decided = plan(noise((33, 20, 7)), scene(pyramid={"coarsest_longest_axis": 9}))
        assert [volume.shape_zyx for volume in decided.volumes] == [(33, 20, 7), (17, 10, 4), (9, 5, 2)]
        assert "pyramid" in decided.stages
        assert "texture" in decided.stages
        assert "mosaic" not in decided.stages

    def test_a_level_beyond_the_limit_of_an_axis_is_left_out_with_the_numbers(self) -> None:
        small = GLES3.model_copy(update={"max_3d_texture_size": 20})
        decided = plan(noise((33, 20, 7)), scene(pyramid={"coarsest_longest_axis": 9}), small)
        assert [level.index for level in decided.levels] == [1, 2]
        left_out = item(decided, "level 0")
        assert not left_out.kept
        assert "7×20×33 voxels, but 3D textures of profile gles3 have at most 20" in left_out.reason
        assert left_out.size_bytes == 33 * 20 * 7
        # The whole volume does not fit: no claim that a grid of sub-volumes is not needed.
        proposed = item(decided, "sub-volumes")
        assert not proposed.kept
        assert proposed.reason.startswith("the scene has no table [grid]. With size = 17 level 0 is 1×2×2 pieces")
        assert f"{8 * 7 * 17 * 17} bytes" in proposed.reason
        assert "--grid auto" in proposed.reason
        assert proposed.size_bytes == 34 * 21 * 7
        # In voxels of the level that it has.
        coarse = scene(pyramid={"coarsest_longest_axis": 9}, render={"step_voxels": 0.5})
        assert plan(noise((33, 20, 7)), coarse, small).rays.step_mm == pytest.approx(0.5 * 2.0)

    def test_a_level_beyond_the_memory_is_left_out_with_the_numbers(self) -> None:
        small = GLES3.model_copy(update={"max_texture_bytes": 4000})
        decided = plan(noise((33, 20, 7)), scene(pyramid={"coarsest_longest_axis": 9}), small)
        assert [level.index for level in decided.levels] == [1, 2]
        assert (
            "4620 bytes, with 2048 for what else is sampled, are more than the 4000" in item(decided, "level 0").reason
        )

    def test_without_3d_textures_the_finest_mosaic_that_fits_and_those_with_an_eighth_of_the_voxels(self) -> None:
        small = GLES2.model_copy(update={"max_texture_size": 64, "texture_units": 2})
        decided = plan(noise((33, 20, 31)), scene(pyramid={"coarsest_longest_axis": 9}), small)
        # One of two units is for the transfer function; 6 tiles of 20×31 with 4 channels hold 24 slices: not the 33
        # of level 0, but the 17 of level 1.
        assert [level.factors_zyx for level in decided.levels] == [(2, 1, 1), (4, 2, 2)]
        assert [level.index for level in decided.levels] == [1, 4]
        assert [program.levels for program in decided.programs] == [(1,), (4,)]
        assert [volume.format for volume in decided.volumes] == ["rgba8unorm", "r8unorm"]
        assert decided.stages == ("import", "quantize", "pyramid", "transfer", "mosaic", "shaders", "seal")
        assert "33 slices of 31×20 voxels, but" in item(decided, "level 0").reason
        assert "room for 24" in item(decided, "level 0").reason
        assert item(decided, "level 2").reason == "level 1 fits and is finer"
        assert not item(decided, "3D texture").kept

    def test_seven_of_eight_units_hold_the_finest_level_beside_the_transfer_function(self) -> None:
        small = GLES2.model_copy(update={"max_texture_size": 64})
        decided = plan(noise((168, 20, 31)), profile=small)
        (volume, *_) = decided.volumes
        assert (volume.level, volume.mosaic.textures, volume.format) == (0, 7, "rgba8unorm")
        assert volume.files == tuple(f"textures/mosaic-scan-0-{part}.ktx2" for part in range(7))
        assert item(decided, "several textures").reason.endswith("room for 24 slices, and there are 168")
        assert plan(noise((169, 20, 31)), profile=small).levels[0].index == 1

    def test_512_cubed_voxels_fit_two_textures_of_4096_squared(self) -> None:
        level = LevelPlan(channel="scan", index=0, factors_zyx=(1, 1, 1), shape_zyx=(512, 512, 512), filter="none")
        larger = load_profile("gles2-4096", Path())
        volume = fit_level(level, 8, larger, Beside(units=1, bytes=1024), MosaicSettings())
        assert (volume.mosaic.textures, volume.mosaic.texture_shape_yx) == (2, (4096, 4096))
        misfit = fit_level(level, 8, GLES2, Beside(units=1, bytes=1024), MosaicSettings())
        assert misfit.reason.endswith(
            "a mosaic in 7 textures of 2048×2048 texels and four channels has room for 448; "
            "1 of 8 texture units is for other textures"
        )
        less = level.model_copy(update={"shape_zyx": (448, 512, 512)})
        roomy = GLES2.model_copy(update={"max_texture_bytes": 2**27})
        assert fit_level(less, 8, roomy, Beside(units=1, bytes=1024), MosaicSettings()).mosaic.textures == 7

    def test_a_scene_states_the_memory_of_its_devices_and_they_hold_the_published_512_cubed_voxels(self) -> None:
        told = scene(textures={"memory_bytes": 134_300_000}).on_device(GLES2)
        level = LevelPlan(channel="scan", index=0, factors_zyx=(1, 1, 1), shape_zyx=(512, 512, 512), filter="none")
        # A palette is constants of the shader: all eight units are for the volume (thesis, section 6.7).
        volume = fit_level(level, 8, told, Beside(units=0, bytes=0), MosaicSettings())
        assert (volume.mosaic.textures, volume.mosaic.texture_shape_yx) == (8, (2048, 2048))
        assert scene().on_device(GLES2) == GLES2

    def test_an_ipad_2_holds_what_was_drawn_on_it(self) -> None:
        level = LevelPlan(channel="scan", index=0, factors_zyx=(1, 1, 1), shape_zyx=(384, 512, 512), filter="none")
        device = load_profile("ipad-2", Path())
        volume = fit_level(level, 8, device, Beside(units=1, bytes=8192), MosaicSettings())
        assert (volume.mosaic.textures, texture_bytes(volume)) == (6, 512 * 512 * 384)

    def test_slices_overlap_where_that_takes_no_more_textures(self) -> None:
        small = GLES2.model_copy(update={"max_texture_size": 64})
        orders = [plan(noise((n, 20, 31)), profile=small).volumes[0].mosaic.order for n in (19, 20, 24, 38, 48)]
        # One texture has room for 3 · 6 + 1 overlapping slices, and for 24 interleaved ones; two for 37 and 48.
        assert orders == ["overlapping", "interleaved", "interleaved", "interleaved", "interleaved"]
        assert plan(noise((37, 20, 31)), profile=small).volumes[0].mosaic.order == "overlapping"
        reason = item(plan(noise((19, 20, 31)), profile=small), "overlapping slices").reason
        assert reason == "each sample takes one fetch instead of 1.25, for a third more memory"

    def test_a_volume_that_fits_no_mosaic_at_any_level_is_an_error_with_the_numbers(self) -> None:
        small = GLES2.model_copy(update={"max_texture_size": 64})
        with pytest.raises(VolprepError, match=r"VP3022 .* level 0: 3 slices of 31×70 voxels, .* has room for 0"):
            plan(noise((3, 70, 31)), scene(pyramid={"coarsest_longest_axis": 70}), small)

    def test_the_scene_chooses_order_and_gutter(self) -> None:
        wanted = {"order": "planar", "gutter": 1}
        layout = plan(noise((5, 20, 31)), scene(mosaic=wanted), GLES2).volumes[0].mosaic
        assert (layout.slices_per_texel, layout.order, layout.gutter) == (4, "planar", 1)

    def test_textures_of_a_mosaic_are_powers_of_two_and_square_where_the_profile_says_so(self) -> None:
        old = GLES2.model_copy(update={"npot": False, "square": True})
        layout = plan(noise((5, 20, 31)), profile=old).volumes[0].mosaic
        assert layout.texture_shape_yx == (64, 64)

    def test_four_channels_only_where_one_is_too_few(self) -> None:
        small = GLES2.model_copy(update={"max_texture_size": 64})
        decided = plan(noise((20, 20, 31)), profile=small)
        (volume,) = decided.volumes
        assert volume.format == "rgba8unorm"
        assert item(decided, "four channels").kept
        assert item(decided, "four channels").reason == "one channel has room for 6 slices, and there are 20"

        decided = plan(noise((6, 20, 31)), profile=small)
        (volume,) = decided.volumes
        assert volume.format == "r8unorm"
        assert not item(decided, "four channels").kept
        assert item(decided, "four channels").reason == "one channel has room for 6 slices, and there are 6"

    def test_a_volume_of_one_level_needs_no_pyramid(self) -> None:
        assert "pyramid" not in plan(noise()).stages

    def test_a_profile_that_nothing_fits_is_an_error_with_the_numbers(self) -> None:
        tiny = GLES3.model_copy(update={"max_texture_bytes": 3037})
        with pytest.raises(VolprepError, match=r"VP3022 .* not even level 0: 990 bytes, with 2048 .* than the 3037 "):
            plan(noise(), profile=tiny)


class TestTables:
    def test_a_table_over_its_own_values_needs_256_entries(self) -> None:
        (lookup,) = plan(noise()).lookups
        assert (lookup.entries, lookup.format) == (256, "rgba16float")

    def test_a_narrow_peak_in_a_wide_window_gets_a_longer_table(self) -> None:
        points = [(1000.0, 0.0), (1003.0, 2.0), (1006.0, 0.0), (3990.0, 0.0), (4000.0, 2.0)]
        voxels = noise((16, 40, 40), 4096, np.uint16)
        decided = plan(voxels, scene(points, quantize={"bits": 16, "window": [0.0, 4095.0]}))
        assert decided.lookups[0].entries > 256

    def test_a_table_is_right_at_rare_values_of_a_single_slice(self) -> None:
        """Rays through more slices mix values, which a table of 256 entries is enough for."""
        points = [(100.0, 0.0), (103.0, 1.5), (4000.0, 8.0)]
        window = {"quantize": {"bits": 16, "window": [0.0, 4095.0]}, "crop": "none"}
        for slices, entries in ((1, 1024), (6, 256)):
            voxels = np.full((slices, 40, 40), 2000, np.uint16)
            voxels[:, 0, :2], voxels[:, 1, 0] = (0, 4095), 101
            assert plan(voxels, scene(points, **window)).lookups[0].entries == entries

    def test_a_table_is_never_longer_than_a_texture_may_be(self) -> None:
        points = [(1000.0, 0.0), (1003.0, 2.0), (1006.0, 0.0), (3990.0, 0.0), (4000.0, 2.0)]
        small = GLES3.model_copy(update={"max_texture_size": 200})
        assert plan(noise(high=4096, dtype=np.uint16), scene(points), small).lookups[0].entries == 200

    def test_without_half_floats_a_table_has_bytes(self) -> None:
        assert plan(noise(), profile=GLES2).lookups[0].format == "rgba8unorm"


class TestRayTermination:
    def test_kept_where_a_ray_can_get_opaque(self) -> None:
        decided = plan(noise(), scene([(0.0, 0.0), (255.0, 9.0)]))
        assert decided.rays.opacity_cutoff == 0.998
        assert item(decided, "early ray termination").kept

    def test_left_out_where_little_lies_behind_unless_the_scene_names_an_opacity(self) -> None:
        # Rays through the last planes of an axis get opaque there, and along the other two only one ray in ten does.
        voxels = np.zeros((10, 10, 10), np.uint8)
        voxels[:, :, 9] = 255
        points = [(0.0, 0.0), (200.0, 0.0), (255.0, 9.0)]
        decided = plan(voxels, scene(points))
        found = item(decided, "early ray termination")
        assert decided.rays.opacity_cutoff is None
        assert not found.kept
        assert "testing each sample costs more time than that" in found.reason
        assert plan(voxels, scene(points, render={"opacity_cutoff": 0.99})).rays.opacity_cutoff == 0.99
        assert plan(voxels, scene(points, render={"opacity_cutoff": 1.0})).rays.opacity_cutoff is None

    def test_samples_behind_count_for_more_where_they_are_lit(self) -> None:
        voxels = np.zeros((10, 10, 10), np.uint8)
        voxels[:, :, 9] = 255
        points = [(0.0, 0.0), (200.0, 0.0), (255.0, 9.0)]
        unlit, lit = (
            item(plan(voxels, scene(points, render={"lighting": lighting})), "early ray termination")
            for lighting in ("none", "headlight")
        )
        assert not unlit.kept
        assert lit.kept
        behind, saved = (float(part) for part in re.findall(r"([\d.]+)%", lit.reason))
        assert behind < 15.0 < saved < 3.5 * behind

    def test_left_out_where_no_ray_can(self) -> None:
        # Diagonal of 9×10×11 mm: 17.4 mm; 0.1 per mm gives opacity 0.82.
        decided = plan(noise(), scene([(0.0, 0.0), (255.0, 0.1)]))
        assert decided.rays.opacity_cutoff is None
        assert not item(decided, "early ray termination").kept
        assert "0.82" in item(decided, "early ray termination").reason

    def test_values_that_the_source_does_not_have_do_not_count(self) -> None:
        points = [(0.0, 0.0), (255.0, 0.1), (400.0, 0.1), (400.0, 50.0)]
        assert plan(noise(), scene(points)).rays.opacity_cutoff is None
        assert plan(noise(high=500, dtype=np.int16), scene(points)).rays.opacity_cutoff == 0.998


def test_the_same_scan_gives_the_same_plan() -> None:
    assert plan(noise()).model_dump_json() == plan(noise()).model_dump_json()


def test_no_file_belongs_to_two_items() -> None:
    for profile in (GLES3, GLES2):
        decided = plan(noise((33, 20, 7)), scene(pyramid={"coarsest_longest_axis": 9}), profile)
        files = [path for each in decided.items for path in each.files]
        assert len(files) == len(set(files))
        assert all(each.kept for each in decided.items if each.files)
