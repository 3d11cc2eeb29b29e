"""What is a grid and what is not, in numbers: tolerances, remarks and what the messages name."""

from pathlib import Path

import numpy as np
import pytest
from dicom_files import ds, image, save_all, stack

from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.source import SourceInfo, SourceSpec


def read_info(images: list, folder: Path) -> SourceInfo:
    save_all(images, folder)
    with open_source(SourceSpec(path="."), folder, Silent()) as source:
        return source.info


def at(*positions_mm_xyz: tuple[float, float, float], **attributes) -> list:
    return [image(np.zeros((3, 4), np.int16), position, **attributes) for position in positions_mm_xyz]


def refusal(images: list, folder: Path) -> VolprepError:
    with pytest.raises(VolprepError) as error:
        read_info(images, folder)
    return error.value


def test_pixel_spacing_is_between_rows_first_and_then_between_columns(tmp_path) -> None:
    info = read_info(at((0, 0, 0), (0, 0, 5), spacing_mm_yx=(2.0, 0.5)), tmp_path)
    assert info.grid.spacing_mm_zyx == (5.0, 2.0, 0.5)


def test_distance_comes_from_positions_and_a_tag_that_contradicts_them_is_remarked(tmp_path) -> None:
    info = read_info(at((0, 0, 0), (0, 0, 4.8), SliceThickness="4", SpacingBetweenSlices="4"), tmp_path)
    assert info.grid.spacing_mm_zyx[0] == 4.8
    assert any("says 4 mm" in remark and "4.8 mm apart" in remark for remark in info.remarks)


def test_the_grid_begins_at_the_lowest_slice_along_the_normal(tmp_path) -> None:
    info = read_info(at((1, 2, 9), (1, 2, 3), (1, 2, 6)), tmp_path)
    assert info.grid.origin_mm_xyz == (1.0, 2.0, 3.0)
    assert np.array_equal(info.grid.direction, np.eye(3))


@pytest.mark.parametrize("digits", [3, 4, 6])
def test_rounded_cosines_become_right_angled(tmp_path, digits) -> None:
    angle = 0.3
    cosines = np.round([np.cos(angle), np.sin(angle), 0, -np.sin(angle) * 0.6, np.cos(angle) * 0.6, 0.8], digits)
    info = read_info(at((0, 0, 0), tuple(np.cross(cosines[:3], cosines[3:])), orientation=cosines), tmp_path)
    direction = np.array(info.grid.direction)
    np.testing.assert_allclose(direction.T @ direction, np.eye(3), atol=1e-12)
    # Each rounded cosine is off by half a unit of its last place; the nearest rotation is no further than that off.
    np.testing.assert_allclose(direction[:, :2].T.ravel(), cosines, atol=10.0**-digits)


def test_cosines_that_are_no_rotation_are_refused(tmp_path) -> None:
    error = refusal(at((0, 0, 0), (0, 0, 1), orientation=(1, 0, 0, 0.1, 1, 0)), tmp_path)
    assert error.code == "VP2004"


def test_positions_with_two_decimals_are_taken_as_even_and_remarked(tmp_path) -> None:
    positions = np.round(np.arange(30) * 0.625, 2)
    info = read_info(at(*((0, 0, z) for z in positions)), tmp_path)
    assert info.grid.spacing_mm_zyx[0] == pytest.approx(0.625, abs=0.01 / 29)
    assert any("from their even places" in remark for remark in info.remarks)


@pytest.mark.parametrize(
    ("pitch_mm", "off_mm", "is_even"),
    [(5, 0.09, True), (5, 0.11, False), (0.15, 0.009, True), (0.15, 0.011, False), (0.05, 0.006, False)],
)
def test_a_slice_may_be_off_by_a_fiftieth_or_by_rounding_but_never_by_a_tenth(
    tmp_path, pitch_mm, off_mm, is_even
) -> None:
    positions = np.arange(6.0) * pitch_mm
    positions[2] += off_mm
    images = at(*((0, 0, z) for z in positions))
    if is_even:
        read_info(images, tmp_path)
    else:
        assert refusal(images, tmp_path).code == "VP2015"


def test_a_jump_in_the_pitch_is_refused_with_both_distances(tmp_path) -> None:
    error = refusal(at(*((0, 0, z) for z in (0, 1, 2, 3, 4.25, 5.5))), tmp_path)
    assert error.code == "VP2015"
    assert "from 1.000 to 1.250 mm" in str(error)
    assert "I003 (slice 3) and I004 (slice 4)" in str(error)


def test_a_slow_drift_of_the_pitch_is_refused_though_each_gap_is_nearly_right(tmp_path) -> None:
    gaps = np.linspace(0.97, 1.03, 40)
    error = refusal(at(*((0, 0, z) for z in np.cumsum(gaps))), tmp_path)
    assert error.code == "VP2015"


def test_the_missing_slices_are_counted_and_their_neighbours_named(tmp_path) -> None:
    error = refusal([data for z, data in enumerate(stack(9)) if z not in {3, 4}], tmp_path)
    assert error.code == "VP2014"
    assert "2 missing slice(s) between I002 (slice 2) and I003 (slice 3)" in str(error)
    assert "the gap is 7.500 mm, the usual distance is 2.500 mm" in str(error)


def test_one_missing_of_four_slices_is_noticed(tmp_path) -> None:
    assert refusal([stack(4)[z] for z in (0, 1, 3)], tmp_path).code == "VP2014"


def test_another_slice_with_the_same_uid_is_refused_and_both_are_named(tmp_path) -> None:
    images = [*stack(5), stack(5)[2]]
    images[5].SOPInstanceUID = images[2].SOPInstanceUID = "1.2.3"
    images[5].PixelData = images[0].PixelData
    error = refusal(images, tmp_path)
    assert error.code == "VP2005"
    assert "I002 and I005, both at (0.000, 0.000, 5.000) mm; they have one SOPInstanceUID, but differ" in str(error)


def test_several_echoes_at_every_place_are_refused_with_what_tells_them_apart(tmp_path) -> None:
    images = [*stack(4), *stack(4), *stack(4)]
    for k, data in enumerate(images):
        data.EchoTime = str(10 + 5 * (k // 4))
    error = refusal(images, tmp_path)
    assert error.code == "VP2006"
    assert "3 images at each of 4 places" in str(error)
    assert "they differ in EchoTime" in str(error)


def test_all_images_at_one_place_are_refused(tmp_path) -> None:
    images = [image(np.full((3, 4), value, np.int16), (0, 0, 1)) for value in range(3)]
    assert refusal(images, tmp_path).code == "VP2006"


def test_a_slice_of_another_orientation_is_refused_with_its_angle(tmp_path) -> None:
    images = stack(5)
    images[3].ImageOrientationPatient = ds([0, 1, 0, 0, 0, -1])
    error = refusal(images, tmp_path)
    assert error.code == "VP2003"
    assert "1 of 5 slices" in str(error)
    assert "is turned by 90.00°" in str(error)


def test_a_slice_of_another_size_is_refused(tmp_path) -> None:
    images = stack(3)
    images[2] = image(np.zeros((4, 4), np.int16), (0, 0, 5))
    error = refusal(images, tmp_path)
    assert error.code == "VP2001"
    assert "I000 has 4×3 pixels, I002 has 4×4" in str(error)


def test_a_slice_of_another_pixel_spacing_is_refused(tmp_path) -> None:
    images = stack(3)
    images[1].PixelSpacing = ["1", "1.01"]
    assert refusal(images, tmp_path).code == "VP2002"


def test_a_slice_that_is_shifted_sideways_is_refused(tmp_path) -> None:
    error = refusal(at((0, 0, 0), (0.2, 0, 1), (0, 0, 2)), tmp_path)
    assert error.code == "VP2008"
    assert "I001 (slice 1) lies 0.200 mm beside" in str(error)


def test_a_drift_below_a_tenth_of_a_pixel_passes_with_a_remark(tmp_path) -> None:
    info = read_info(at((0, 0, 0), (0.02, 0, 1), (0.04, 0, 2)), tmp_path)
    assert any("drift sideways by 0.04 mm" in remark for remark in info.remarks)


def test_a_single_slice_without_any_thickness_is_refused(tmp_path) -> None:
    error = refusal(at((0, 0, 0)), tmp_path)
    assert (error.code, error.fields["keyword"]) == ("VP1036", "SliceThickness")
