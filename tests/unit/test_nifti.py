"""NIfTI volumes: places in LPS, types, scaling, and what is refused."""

import gzip
from pathlib import Path

import nibabel
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from volprep_formats.diagnostics import VolprepError
from volprep_formats.nifti_header import VOXEL_TYPES, parsed, qform_of
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.readers.voxel_file import MAX_DEFLATE_RATIO
from volprep_formats.source import SourceInfo, SourceSpec

SHAPE_XYZ = (4, 1, 3)
LPS_FROM_RAS = np.diag([-1.0, -1.0, 1.0, 1.0])


def read(path: Path) -> tuple[np.ndarray, SourceInfo]:
    with open_source(SourceSpec(path=str(path)), Path(), Silent()) as source:
        return source.read_slab(0, source.info.grid.shape_zyx[0]), source.info


def save(
    path: Path, voxels_xyz: np.ndarray, affine: np.ndarray | None = None, kind=nibabel.Nifti1Image, **header
) -> Path:
    picture = kind(voxels_xyz, np.eye(4) if affine is None else affine, dtype=voxels_xyz.dtype)
    picture.header.set_xyzt_units("mm")
    for key, value in header.items():
        picture.header[key] = value
    nibabel.save(picture, path)
    return path


def patched(path: Path, offset: int, data: bytes) -> Path:
    whole = bytearray(path.read_bytes())
    whole[offset : offset + len(data)] = data
    path.write_bytes(whole)
    return path


def refusal(path: Path) -> VolprepError:
    with pytest.raises(VolprepError) as error:
        read(path)
    return error.value


def noise(dtype: str = "int16", shape=SHAPE_XYZ) -> np.ndarray:
    return np.random.default_rng(4).integers(0, 100, shape).astype(dtype)


@given(st.lists(st.floats(-1, 1), min_size=9, max_size=9), st.tuples(*[st.floats(0.01, 9.0)] * 3), st.booleans())
def test_every_voxel_lies_where_the_affine_puts_it_in_lps(tmp_path_factory, turn, spacing, mirrored) -> None:
    rotation = np.linalg.qr(np.array(turn).reshape(3, 3) + 2 * np.eye(3))[0]
    affine = np.eye(4)
    affine[:3, :3] = rotation * spacing
    affine[:3, 0] *= -1 if mirrored else 1
    affine[:3, 3] = (10.0, -20.0, 300.0)
    voxels = noise()
    values, info = read(save(tmp_path_factory.mktemp("nifti") / "v.nii", voxels, affine))
    assert np.array_equal(values, voxels.T)
    # The sform has 32-bit numbers: 2^-24 of 300 mm is 2e-5 mm.
    np.testing.assert_allclose(info.grid.world_from_index, LPS_FROM_RAS @ affine, atol=4e-5)


@pytest.mark.parametrize("name", ["v.nii", "v.nii.gz"])
@pytest.mark.parametrize("kind", [nibabel.Nifti1Image, nibabel.Nifti2Image])
def test_both_versions_are_read_plain_and_gzipped(tmp_path, name, kind) -> None:
    values, info = read(save(tmp_path / name, noise(), kind=kind))
    assert np.array_equal(values, noise().T)
    assert info.format == "nifti"


def test_big_endian_files_are_read(tmp_path) -> None:
    header = nibabel.Nifti1Header(endianness=">")
    header.set_data_dtype(np.int16)
    nibabel.save(nibabel.Nifti1Image(noise(), np.eye(4), header), tmp_path / "v.nii")
    assert (tmp_path / "v.nii").read_bytes()[:4] == b"\0\0\x01\x5c"
    values, _ = read(tmp_path / "v.nii")
    assert values.dtype.isnative
    assert np.array_equal(values, noise().T)


@pytest.mark.parametrize(
    ("dtype", "stored"),
    [
        ("uint8", "uint8"),
        ("int8", "int16"),
        ("int16", "int16"),
        ("uint16", "uint16"),
        ("float32", "float32"),
        ("float64", "float32"),
    ],
)
def test_voxels_keep_their_values_in_the_smallest_type_that_holds_theirs(tmp_path, dtype, stored) -> None:
    values, info = read(save(tmp_path / "v.nii", noise(dtype)))
    assert info.stored_type == stored == values.dtype.name
    assert np.array_equal(values, noise(dtype).T)


@pytest.mark.parametrize(
    ("largest", "stored"),
    [(255, "uint8"), (-1, "int16"), (65535, "uint16"), (2**24, "float32"), (2**30 + 1, "float32")],
)
def test_wide_integers_are_read_in_the_smallest_type_that_holds_their_values(tmp_path, largest, stored) -> None:
    voxels = np.zeros(SHAPE_XYZ, np.int32)
    voxels[2, 0, 1] = largest
    values, info = read(save(tmp_path / "v.nii", voxels))
    assert info.stored_type == stored
    assert values[1, 0, 2] == np.float32(largest) if stored == "float32" else largest
    assert any("rounded" in remark for remark in info.remarks) == (largest > 2**24)


def test_slope_and_intercept_are_kept_beside_the_stored_values(tmp_path) -> None:
    file = patched(save(tmp_path / "v.nii", noise()), 112, np.array([0.5, -10.0], "<f4").tobytes())
    values, info = read(file)
    assert (info.slope, info.intercept) == (0.5, -10.0)
    assert np.array_equal(values, noise().T)


def test_a_slope_of_zero_means_none(tmp_path) -> None:
    file = patched(save(tmp_path / "v.nii", noise()), 112, np.array([0.0, 5.0], "<f4").tobytes())
    _, info = read(file)
    assert (info.slope, info.intercept) == (1.0, 0.0)


def test_micrometres_become_millimetres(tmp_path) -> None:
    picture = nibabel.Nifti1Image(noise(), np.diag([5.0, 5.0, 5.0, 1.0]))
    picture.header.set_xyzt_units("micron")
    nibabel.save(picture, tmp_path / "v.nii")
    _, info = read(tmp_path / "v.nii")
    assert info.grid.spacing_mm_zyx == pytest.approx((0.005, 0.005, 0.005))


def test_without_an_sform_the_qform_places_the_volume(tmp_path) -> None:
    affine = np.diag([2.0, 3.0, 4.0, 1.0])
    affine[:3, 3] = (1, 2, 3)
    picture = nibabel.Nifti1Image(noise(), None)
    picture.header.set_xyzt_units("mm")
    picture.set_qform(affine, 1)
    nibabel.save(picture, tmp_path / "v.nii")
    _, info = read(tmp_path / "v.nii")
    np.testing.assert_allclose(info.grid.world_from_index, LPS_FROM_RAS @ affine, atol=1e-6)


def test_without_any_form_the_spacing_holds_and_a_remark_says_so(tmp_path) -> None:
    picture = nibabel.Nifti1Image(noise(), None)
    picture.header.set_zooms((2.0, 3.0, 4.0))
    nibabel.save(picture, tmp_path / "v.nii")
    _, info = read(tmp_path / "v.nii")
    assert info.grid.spacing_mm_zyx == (4.0, 3.0, 2.0)
    assert any("does not say how the volume lies" in remark for remark in info.remarks)


def test_forms_that_disagree_are_remarked_and_the_sform_holds(tmp_path) -> None:
    picture = nibabel.Nifti1Image(noise(), np.eye(4))
    moved = np.eye(4)
    moved[0, 3] = 7.0
    picture.set_qform(moved, 1)
    nibabel.save(picture, tmp_path / "v.nii")
    _, info = read(tmp_path / "v.nii")
    assert info.grid.origin_mm_xyz == (0.0, 0.0, 0.0)
    assert any("7 apart" in remark for remark in info.remarks)


def test_a_pixdim_that_contradicts_a_lonely_sform_is_remarked(tmp_path) -> None:
    for name, spacing in (("lie", 3.0), ("sound", 2.0)):
        picture = nibabel.Nifti1Image(noise(), None)
        picture.header.set_sform(np.diag([2.0, 2.0, 2.0, 1.0]), 1)
        picture.header["pixdim"][1:4] = (2.0, 2.0, spacing)
        nibabel.save(picture, tmp_path / f"{name}.nii")
    _, info = read(tmp_path / "lie.nii")
    assert info.grid.spacing_mm_zyx == (2.0, 2.0, 2.0)
    assert any("pixdim says voxels of 2 × 2 × 3" in remark for remark in info.remarks)
    assert not any("pixdim" in remark for remark in read(tmp_path / "sound.nii")[1].remarks)


def test_a_qfac_of_zero_is_one(tmp_path) -> None:
    picture = nibabel.Nifti1Image(noise(), None)
    picture.header.set_xyzt_units("mm")
    picture.set_qform(np.diag([2.0, 3.0, 4.0, 1.0]), 1)
    nibabel.save(picture, tmp_path / "v.nii")
    whole = bytearray((tmp_path / "v.nii").read_bytes())
    whole[76:80] = bytes(4)
    (tmp_path / "v.nii").write_bytes(whole)
    assert read(tmp_path / "v.nii")[1].grid.spacing_mm_zyx == (4.0, 3.0, 2.0)


def test_trailing_axes_of_one_are_dropped_and_missing_ones_added(tmp_path) -> None:
    assert read(save(tmp_path / "a.nii", noise(shape=(4, 5, 3, 1, 1))))[0].shape == (3, 5, 4)
    assert read(save(tmp_path / "b.nii", noise(shape=(4, 5))))[0].shape == (1, 5, 4)


def test_a_sheared_affine_is_refused_with_its_angle(tmp_path) -> None:
    affine = np.eye(4)
    affine[0, 1] = np.tan(np.radians(5.0))
    error = refusal(save(tmp_path / "v.nii", noise(), affine))
    assert error.code == "VP2020"
    assert "5.000°" in str(error)


@pytest.mark.parametrize("value", [0.0, np.nan, np.inf, 1e30])
def test_an_unusable_affine_is_refused(tmp_path, value) -> None:
    file = save(tmp_path / "v.nii", noise())
    assert refusal(patched(file, 280, np.array([value, 0, 0, 0], "<f4").tobytes())).code == "VP2021"


@pytest.mark.parametrize("value", [1e200, -1e300, np.inf])
def test_an_affine_beyond_all_bounds_is_refused_in_double_precision(tmp_path, value) -> None:
    nibabel.save(nibabel.Nifti2Image(noise(), np.eye(4)), tmp_path / "v.nii")
    assert refusal(patched(tmp_path / "v.nii", 400, np.array([value], "<f8").tobytes())).code == "VP2021"


@pytest.mark.parametrize(("unit", "millimetres"), [(1, 1000.0), (2, 1.0), (3, 0.001), (0, 1.0)])
@pytest.mark.parametrize("time_unit", [0, 8, 64, 192])
def test_the_unit_of_length_stands_beside_any_unit_of_time(tmp_path, unit, millimetres, time_unit) -> None:
    file = patched(save(tmp_path / "v.nii", noise()), 123, bytes([unit + time_unit]))
    with open_source(SourceSpec(path=str(file)), Path(), Silent()) as source:
        assert source.info.grid.spacing_mm_zyx == pytest.approx((millimetres,) * 3)


@pytest.mark.parametrize("unit", [4, 7])
def test_an_unknown_unit_of_length_is_refused(tmp_path, unit) -> None:
    error = refusal(patched(save(tmp_path / "v.nii", noise()), 123, bytes([unit])))
    assert error.code == "VP2021"
    assert "unit of length" in str(error)


def test_a_voxel_type_that_nobody_knows_is_refused(tmp_path) -> None:
    error = refusal(patched(save(tmp_path / "v.nii", noise()), 70, np.array([516], "<i2").tobytes()))
    assert error.code == "VP1022"
    assert "516" in str(error)


def test_an_axis_that_is_too_long_is_refused_before_anything_is_made_of_it(tmp_path) -> None:
    nibabel.save(nibabel.Nifti2Image(noise(), np.eye(4)), tmp_path / "v.nii")
    error = refusal(patched(tmp_path / "v.nii", 24, np.array([2**40], "<i8").tobytes()))
    assert error.code == "VP1020"
    assert str(2**40) in str(error)


def test_doubles_beyond_floats_become_infinite(tmp_path) -> None:
    values = np.array([[[1e300, -1e300, 1.0]]])
    with open_source(SourceSpec(path=str(save(tmp_path / "v.nii", values))), Path(), Silent()) as source:
        assert source.read_slab(0, 3).ravel().tolist() == [np.inf, -np.inf, 1.0]


def test_a_quaternion_that_is_none_is_refused(tmp_path) -> None:
    picture = nibabel.Nifti1Image(noise(), None)
    picture.set_qform(np.eye(4), 1)
    nibabel.save(picture, tmp_path / "v.nii")
    assert refusal(patched(tmp_path / "v.nii", 256, np.array([3, 0, 0], "<f4").tobytes())).code == "VP2021"


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize("kind", [nibabel.Nifti1Header, nibabel.Nifti2Header])
def test_headers_of_both_versions_and_orders_say_what_nibabel_reads(kind, order) -> None:
    generator = np.random.default_rng(5)
    for dtype in (np.uint8, np.int16, np.float32, np.float64):
        header = kind(endianness=order)
        header.set_data_shape((5, 4, 3))
        header.set_data_dtype(dtype)
        axes, _ = np.linalg.qr(generator.normal(size=(3, 3)))
        affine = np.eye(4)
        affine[:3] = np.column_stack([axes * generator.uniform(0.1, 5.0, 3), generator.normal(size=3)])
        header.set_qform(affine, 1)
        header.set_sform(affine, 2)
        header.set_xyzt_units("micron", "msec")
        for number, name in enumerate(["scl_slope", "scl_inter", "toffset", "vox_offset", "intent_code"], 3):
            header[name] = number
        ours = parsed(header.binaryblock)
        for name in set(ours.dtype.names) - {"quatern", "qoffset", "srow"}:
            np.testing.assert_array_equal(ours[name], header[name], name)
        np.testing.assert_array_equal(ours["srow"], header.get_sform()[:3])
        np.testing.assert_allclose(qform_of(ours), header.get_qform(), atol=1e-12)
        assert VOXEL_TYPES[int(ours["datatype"])].newbyteorder(order) == header.get_data_dtype()


def test_several_volumes_without_a_choice_are_refused(tmp_path) -> None:
    error = refusal(save(tmp_path / "v.nii", noise(shape=(4, 5, 3, 2))))
    assert error.code == "VP1021"
    assert "4×5×3×2" in str(error)
    assert "1 to 2" in str(error)


@pytest.mark.parametrize("name", ["v.nii", "v.nii.gz"])
def test_one_of_several_volumes_is_read_by_its_number(tmp_path, name) -> None:
    values = noise(shape=(4, 5, 3, 2, 3))
    file = save(tmp_path / name, values)
    for number in range(1, 7):
        with open_source(SourceSpec(path=str(file), volume=number), Path(), Silent()) as source:
            expected = values[..., (number - 1) % 2, (number - 1) // 2].T
            assert np.array_equal(source.read_slab(0, 3), expected)
            assert source.info.grid.shape_zyx == (3, 5, 4)
    for number in (7, 10**9):
        with pytest.raises(VolprepError, match=f"VP1021 .*; there is no volume {number}"):
            open_source(SourceSpec(path=str(file), volume=number), Path(), Silent())


@pytest.mark.parametrize("dims", [[3, 4, -1, 3], [3, 4, 0, 3], [0, 4, 1, 3], [9, 4, 1, 3], [-3, 4, 1, 3]])
def test_impossible_dimensions_are_refused(tmp_path, dims) -> None:
    file = patched(save(tmp_path / "v.nii", noise()), 40, np.array(dims, "<i2").tobytes())
    assert refusal(file).code in {"VP1020", "VP1021"}


def test_colour_voxels_are_refused(tmp_path) -> None:
    rgb = np.zeros(SHAPE_XYZ, dtype=[("R", "u1"), ("G", "u1"), ("B", "u1")])
    assert refusal(save(tmp_path / "v.nii", rgb)).code == "VP1022"


def test_a_cut_gzip_stream_is_refused_with_the_bytes_that_it_has(tmp_path) -> None:
    voxels = np.random.default_rng(5).integers(-9000, 9000, (40, 40, 20)).astype(np.int16)
    whole = gzip.compress(save(tmp_path / "v.nii", voxels).read_bytes())
    (tmp_path / "v.nii.gz").write_bytes(whole[: len(whole) * 3 // 4])
    error = refusal(tmp_path / "v.nii.gz")
    assert error.code == "VP1008"
    assert 0 < error.fields["actual"] < error.fields["expected"]


@pytest.mark.parametrize("name", ["v.nii", "v.nii.gz"])
def test_declared_sizes_beyond_the_file_are_refused_before_anything_is_allocated(tmp_path, name) -> None:
    file = save(tmp_path / "v.nii", noise())
    patched(file, 40, np.array([3, 32767, 32767, 32767], "<i2").tobytes())
    if name.endswith(".gz"):
        file = tmp_path / name
        file.write_bytes(gzip.compress((tmp_path / "v.nii").read_bytes()))
    error = refusal(file)
    assert error.code == "VP1008"
    size = file.stat().st_size * (MAX_DEFLATE_RATIO if name.endswith(".gz") else 1)
    assert f"can unpack to, {size - 352}" in str(error)


@pytest.mark.parametrize("name", ["v.nii", "v.nii.gz"])
def test_every_cut_is_refused(tmp_path, name) -> None:
    whole = save(tmp_path / name, noise()).read_bytes()
    for size in [*range(0, len(whole), 7), len(whole) - 1]:
        (tmp_path / name).write_bytes(whole[:size])
        with pytest.raises(VolprepError) as error:
            read(tmp_path / name)
        assert error.value.code in {"VP1002", "VP1005", "VP1020", "VP1021", "VP1008"}


def test_a_checksum_that_is_cut_off_or_wrong_is_refused(tmp_path) -> None:
    # Larger than any buffer, so that the last voxel is there before the checksum is looked at.
    file = save(tmp_path / "v.nii.gz", np.random.default_rng(0).integers(0, 255, (64, 64, 64)).astype(np.uint8))
    whole = file.read_bytes()
    for damaged in (whole[:-4], whole[:-8] + bytes(4) + whole[-4:]):
        file.write_bytes(damaged)
        assert refusal(file).code == "VP1005"


@pytest.mark.parametrize("bits", [8, 32, 15, -16])
def test_bits_that_are_not_those_of_the_type_are_refused(tmp_path, bits) -> None:
    file = patched(save(tmp_path / "v.nii", noise()), 72, np.array(bits, "<i2").tobytes())
    error = refusal(file)
    assert error.code == "VP1020"
    assert f"{bits} bits" in str(error)


def test_bits_that_are_left_out_are_remarked(tmp_path) -> None:
    values, info = read(patched(save(tmp_path / "v.nii", noise()), 72, bytes(2)))
    assert np.array_equal(values, noise().T)
    assert any("16 of int16" in remark for remark in info.remarks)


@pytest.mark.parametrize("offset", [348.0, 351.0, 352.5, -16.0, float("nan")])
def test_voxels_that_begin_within_the_header_are_refused(tmp_path, offset) -> None:
    file = patched(save(tmp_path / "v.nii", noise()), 108, np.array(offset, "<f4").tobytes())
    assert refusal(file).code == "VP1020"


def test_voxels_that_begin_within_the_longer_header_of_version_2_are_refused(tmp_path) -> None:
    file = save(tmp_path / "v.nii", noise(), kind=nibabel.Nifti2Image)
    assert refusal(patched(file, 168, np.array(540, "<i8").tobytes())).code == "VP1020"


def packed_as(name: str, path: Path) -> Path:
    if name.endswith(".gz"):
        path.with_name(name).write_bytes(gzip.compress(path.read_bytes()))
        return path.with_name(name)
    return path


@pytest.mark.parametrize("name", ["v.nii", "v.nii.gz"])
@pytest.mark.parametrize("dims", [[3, 4, 5, 2], [3, 4, 5, 1], [4, 4, 5, 1, 2], [2, 4, 5]])
def test_a_file_that_holds_more_slices_or_volumes_than_it_declares_is_refused(tmp_path, name, dims) -> None:
    file = save(tmp_path / "v.nii", noise(shape=(4, 5, 3)))
    told = np.ones(8, "<i2")
    told[: len(dims)] = dims
    file = packed_as(name, patched(file, 40, told.tobytes()))
    spec = SourceSpec(path=str(file), volume=2 if dims[0] == 4 else None)
    with pytest.raises(VolprepError, match="VP1008"), open_source(spec, Path(), Silent()) as source:
        source.read_slab(0, source.info.grid.shape_zyx[0])


@pytest.mark.parametrize("name", ["v.nii", "v.nii.gz"])
def test_padding_of_less_than_a_slice_is_read_over(tmp_path, name) -> None:
    values = noise(shape=(4, 5, 3))
    file = save(tmp_path / "v.nii", values)
    file.write_bytes(file.read_bytes() + bytes(39))
    found, info = read(packed_as(name, file))
    assert np.array_equal(found, values.T)
    assert name.endswith(".gz") or any(remark.startswith("39 bytes follow") for remark in info.remarks)


def test_colours_are_refused_by_their_name(tmp_path) -> None:
    colours = np.zeros(SHAPE_XYZ, dtype=[("R", "u1"), ("G", "u1"), ("B", "u1")])
    nibabel.save(nibabel.Nifti1Image(colours, np.eye(4)), tmp_path / "v.nii")
    assert "type RGB24 cannot be read" in refusal(tmp_path / "v.nii").summary
