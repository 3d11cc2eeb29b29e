"""Steps of a scan with its segments: measured along rays that know the labels."""

from dataclasses import replace

import numpy as np
import pytest
from segment_scan import built, drawn, truth, write_segments

from volprep.compositing import COMPOSITINGS
from volprep.parts.levels.label_rays import LabelLooks
from volprep.parts.levels.rays import RaySegments
from volprep.parts.programs.patch_rays import PatchRays
from volprep.parts.programs.step_bench import STEP_SHARE, StepBench
from volprep.scan.in_memory import InMemory
from volprep.truth.seen import seen_pixels
from volprep_formats.package.function_table import Table

SPACING_MM_ZYX = (2.0, 1.0, 0.5)


def looks_of(labels: np.ndarray) -> LabelLooks:
    """Label 1 has the first style, half as opaque and red; labels 0 and 2 have the second one."""
    looks = np.zeros((2, 3, 4))
    looks[0, 1] = (0.5, 0.0, 0.0, 0.5)
    looks[1, [0, 2]] = 1.0
    return LabelLooks(InMemory.of(labels), looks)


def test_labels_around_a_sample_count_by_their_trilinear_weights() -> None:
    labels = np.random.default_rng(4).integers(0, 3, (5, 4, 6)).astype(np.uint16)
    starts, direction = np.array([[0.7, 1.1, 2.3]]), np.array([[0.0, 0.6, 0.8]])
    lines = RaySegments(starts, direction, np.array([3.0]))
    found = looks_of(labels).along(SPACING_MM_ZYX, lines, np.array([4]))
    assert found.shape == (2, 4, 4)
    for sample in range(4):
        place = (starts[0] + direction[0] * (sample + 0.5) * 0.75) / np.array(SPACING_MM_ZYX[::-1]) - 0.5
        weights = np.zeros(3)
        low = np.floor(place).astype(int)
        for corner in np.ndindex(2, 2, 2):
            x, y, z = low + corner
            share = np.prod(np.where(np.array(corner) == 1, place - low, 1 - (place - low)))
            weights[labels[z, y, x]] += share
        np.testing.assert_allclose(found[0, sample], weights[1] * np.array([0.5, 0, 0, 0.5]), atol=1e-4)
        np.testing.assert_allclose(found[1, sample], np.full(4, weights[0] + weights[2]), atol=1e-4)


def test_borders_have_the_slope_of_the_logarithm_of_the_visible_extinction() -> None:
    labels = np.zeros((4, 4, 12), np.uint16)
    labels[:, :, 6:] = 1
    lines = RaySegments(np.array([[2.5, 2.0, 4.0]]), np.array([[1.0, 0.0, 0.0]]), np.array([1.0]))
    tables = [Table(np.array([0.0]), np.ones((1, 3)), np.array([each])) for each in (0.8, 0.1)]
    borders = looks_of(labels).border_slopes(SPACING_MM_ZYX, tables, np.zeros(3), 2.0)
    slopes = borders(lines, np.array([1]), np.array([False, True, False]))
    # Halfway between voxels of extinctions 0.1 and 0.4 that are 0.5 mm apart; 2 stands for 1 per millimetre.
    np.testing.assert_allclose(slopes[:, 0], [2.0 * (0.4 - 0.1) / 0.5 / 0.25, 0.0, 0.0], rtol=1e-3)


def test_a_style_counts_only_where_its_labels_are() -> None:
    compositing = COMPOSITINGS["emission-absorption"]
    soft = Table(np.array([0.0, 1.0]), np.ones((2, 3)), np.array([0.01, 0.012]))
    wall = Table(np.array([0.4, 0.6]), np.ones((2, 3)), np.array([0.0, 0.5]))
    # Values jump in the first half of the rays, not in the second.
    values = np.random.default_rng(2).integers(0, 2, (20, 9)).repeat(8, axis=0) * (np.arange(160) < 72)[:, None]
    rays = PatchRays(values.astype(np.float64), 0.1, (slice(0, 9),))
    looks = np.zeros((2, *values.shape, 4), np.float32)
    looks[0, :80], looks[1, 80:] = 1.0, 1.0
    labelled = replace(rays, looks=looks)
    without = StepBench(compositing, [soft, wall], [rays], is_segments=False)
    measured = StepBench(compositing, [soft, wall], [labelled], is_segments=False)
    assert without.error(1.0).rmse > 0.03
    assert measured.error(1.0).rmse < 0.003
    # Where they are, they count.
    swapped = StepBench(compositing, [soft, wall], [replace(rays, looks=looks[::-1].copy())], is_segments=False)
    assert swapped.error(1.0).rmse > 0.03


@pytest.mark.parametrize("lighting", ["none", "headlight"])
def test_the_step_of_a_scan_with_segments_keeps_its_promise(tmp_path, lighting) -> None:
    folder = write_segments(tmp_path)
    change = {"render": {"step_voxels": "auto", "lighting": lighting, "opacity_cutoff": 1.0}}
    dense = {"value": 255.0, "colour": "#ffffff", "extinction_per_mm": 6.0}
    inside = {"name": "inside", "points": [{"value": 90.0, "colour": "#c0c0c0", "extinction_per_mm": 0.0}, dense]}
    veil = {"name": "veil", "points": [{"value": 0.0, "colour": "#808080", "extinction_per_mm": 0.03}]}
    package = built(folder, "auto", change={**change, "transfer": [veil, inside]}, border="mixed")
    (step,) = [item for item in package.manifest.plan if item.kind == "step"]
    errors = []
    for view in ("anterior", "left", "superior", "anterior-left", "posterior-left"):
        picture, expected = drawn(package, view), truth(folder, package, view)
        seen = seen_pixels(picture, expected)
        errors.append(np.sqrt(np.mean((picture - expected)[seen] ** 2)))
    assert max(errors) <= STEP_SHARE * package.manifest.render.tolerance.rmse, step.reason
