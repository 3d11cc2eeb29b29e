"""NRRD volumes: places in LPS, encodings, types, detached files, and what is refused."""

import bz2
import gzip
from pathlib import Path

import nrrd
import numpy as np
import pytest
from header_files import SHAPE_ZYX, check_every_cut, noise, read, refusal, refusal_at_open
from hypothesis import given
from hypothesis import strategies as st

from volprep_formats.readers.nrrd import _TYPES, open_layers

FIELDS = {
    "type": "short",
    "dimension": "3",
    "space": "left-posterior-superior",
    "sizes": "4 1 3",
    "space directions": "(2,0,0) (0,3,0) (0,0,4)",
    "kinds": "domain domain domain",
    "endian": "little",
    "encoding": "raw",
    "space origin": "(1,2,3)",
}
ORIENTATION = ("space", "space directions", "space origin")


def header(without=(), **fields: str) -> bytes:
    """Header with some fields changed (underscores stand for blanks) or left out."""
    all_fields = FIELDS | {name.replace("_", " "): value for name, value in fields.items()}
    lines = [f"{name}: {value}" for name, value in all_fields.items() if name not in without]
    return "\n".join(["NRRD0005", *lines, "", ""]).encode()


def save(path: Path, without=(), data: bytes | None = None, **fields: str) -> Path:
    path.write_bytes(header(without, **fields) + (noise().tobytes() if data is None else data))
    return path


@given(st.lists(st.floats(-1, 1), min_size=9, max_size=9), st.tuples(*[st.floats(0.01, 9.0)] * 3), st.booleans())
def test_every_voxel_lies_where_the_directions_put_it(tmp_path_factory, turn, spacing, mirrored) -> None:
    columns = np.linalg.qr(np.array(turn).reshape(3, 3) + 2 * np.eye(3))[0] * spacing
    columns[:, 0] *= -1 if mirrored else 1
    file = tmp_path_factory.mktemp("nrrd") / "v.nrrd"
    told = {"space": "left-posterior-superior", "space directions": columns.T, "space origin": [10.0, -20.0, 300.0]}
    nrrd.write(str(file), noise(), told, index_order="C")
    values, info = read(file)
    assert np.array_equal(values, noise())
    np.testing.assert_allclose(info.grid.world_from_index[:3, :3], columns, atol=1e-12)
    assert info.grid.origin_mm_xyz == (10.0, -20.0, 300.0)
    assert info.remarks == ()


@pytest.mark.parametrize(
    ("space", "signs"),
    [
        ("left-posterior-superior", (1, 1, 1)),
        ("LPS", (1, 1, 1)),
        ("right-anterior-superior", (-1, -1, 1)),
        ("RAS", (-1, -1, 1)),
        ("Left-Anterior-Superior", (1, -1, 1)),
        ("las", (1, -1, 1)),
    ],
)
def test_each_space_of_the_patient_is_turned_into_lps(tmp_path, space, signs) -> None:
    directions = "(0,2,0) (0,0,-3) (4,0,0)"
    _, info = read(save(tmp_path / "v.nrrd", space=space, space_directions=directions))
    expected = np.diag(signs) @ [[0, 0, 4], [2, 0, 0], [0, -3, 0]]
    np.testing.assert_array_equal(info.grid.world_from_index[:3, :3], expected)
    np.testing.assert_array_equal(info.grid.origin_mm_xyz, np.array(signs) * (1, 2, 3))
    assert info.grid.spacing_mm_zyx == (4, 3, 2)


def test_spacings_place_a_volume_without_a_space_and_a_remark_says_so(tmp_path) -> None:
    _, info = read(save(tmp_path / "v.nrrd", ORIENTATION, spacings="2 -3 0.5"))
    np.testing.assert_array_equal(info.grid.world_from_index, np.diag([2, -3, 0.5, 1]))
    assert any("does not say how the volume lies" in remark for remark in info.remarks)


def test_a_volume_without_spacings_has_one_millimetre_and_a_remark_says_so(tmp_path) -> None:
    _, info = read(save(tmp_path / "v.nrrd", ORIENTATION))
    assert info.grid.spacing_mm_zyx == (1, 1, 1)
    assert any("1 mm is assumed" in remark for remark in info.remarks)


def test_a_volume_without_an_origin_is_put_at_zero_and_a_remark_says_so(tmp_path) -> None:
    _, info = read(save(tmp_path / "v.nrrd", ["space origin"]))
    assert info.grid.origin_mm_xyz == (0, 0, 0)
    assert any("does not say where" in remark for remark in info.remarks)


@pytest.mark.parametrize(("unit", "mm"), [("mm", 1), ("um", 1e-3), ("µm", 1e-3), ("cm", 10), ("m", 1000)])
def test_units_become_millimetres(tmp_path, unit, mm) -> None:
    file = save(tmp_path / "v.nrrd", space_units=f'"{unit}" "mm" "{unit}"')
    _, info = read(file)
    assert info.grid.spacing_mm_zyx == pytest.approx((4 * mm, 3, 2 * mm), rel=1e-15)
    assert info.grid.origin_mm_xyz == pytest.approx((1 * mm, 2, 3 * mm), rel=1e-15)
    _, info = read(save(file, ORIENTATION, spacings="2 3 4", units=f'"{unit}" "mm" "{unit}"'))
    assert info.grid.spacing_mm_zyx == pytest.approx((4 * mm, 3, 2 * mm), rel=1e-15)


@pytest.mark.parametrize("endian", ["little", "big"])
@pytest.mark.parametrize(("encoding", "pack"), [("raw", bytes), ("gzip", gzip.compress), ("bz2", bz2.compress)])
def test_every_encoding_and_byte_order_gives_the_same_voxels(tmp_path, encoding, pack, endian) -> None:
    data = pack(noise("<i2" if endian == "little" else ">i2").tobytes())
    values, info = read(save(tmp_path / "v.nrrd", data=data, encoding=encoding, endian=endian))
    assert info.format == "nrrd"
    assert values.dtype == np.int16
    assert np.array_equal(values, noise())


@pytest.mark.parametrize("text", [b" ".join, b"\n".join, b", ".join])
def test_numbers_as_text_are_read(tmp_path, text) -> None:
    data = text([b"%d" % value for value in noise().ravel() - 50])
    values, _ = read(save(tmp_path / "v.nrrd", ["endian"], data=data, encoding="ascii"))
    assert np.array_equal(values, noise() - 50)
    data = text([b"%.9g" % value for value in noise().ravel() / np.float32(3)])
    values, _ = read(save(tmp_path / "v.nrrd", data=data, encoding="txt", type="float"))
    assert np.array_equal(values, noise() / np.float32(3))


@pytest.mark.parametrize("word", [b"x", b"1_0", b"70000", b"1.5", b"\xd9\xa1", b"9" * 5000])
def test_text_that_is_no_number_of_the_type_is_refused(tmp_path, word) -> None:
    data = b"1 " * 5 + word + b" 1" * 6
    error = refusal(save(tmp_path / "v.nrrd", data=data, encoding="ascii"))
    assert error.code == "VP1007"


@pytest.mark.parametrize("word", ["nan", "1e39", "-inf"])
def test_text_may_hold_floats_that_are_not_finite(tmp_path, word) -> None:
    values, _ = read(save(tmp_path / "v.nrrd", data=f"{word} ".encode() * 12, encoding="ascii", type="float"))
    assert not np.isfinite(values).any()


@pytest.mark.parametrize("name", [*_TYPES])
def test_every_type_keeps_its_values(tmp_path, name) -> None:
    code = np.dtype(_TYPES[name])
    values, info = read(save(tmp_path / "v.nrrd", data=noise(code.name).tobytes(), type=name))
    kept = {"i1": "int16", "u1": "uint8", "i2": "int16", "u2": "uint16", "f4": "float32", "f8": "float32"}
    assert info.stored_type == kept.get(_TYPES[name], "uint8")
    assert np.array_equal(values, noise())


def test_doubles_too_large_for_floats_become_infinite(tmp_path) -> None:
    values, _ = read(save(tmp_path / "v.nrrd", data=np.full(12, 1e300).tobytes(), type="double"))
    assert np.isinf(values).all()


@pytest.mark.parametrize(
    ("largest", "stored"),
    [(255, "uint8"), (-1, "int16"), (65535, "uint16"), (2**24, "float32"), (2**30 + 1, "float32")],
)
@pytest.mark.parametrize("pack", [bytes, gzip.compress])
def test_wide_integers_take_the_smallest_type_that_holds_their_values(tmp_path, largest, stored, pack) -> None:
    voxels = np.zeros(SHAPE_ZYX, np.int32)
    voxels[2, 0, 1] = largest
    encoding = "raw" if pack is bytes else "gzip"
    values, info = read(save(tmp_path / "v.nrrd", data=pack(voxels.tobytes()), type="int", encoding=encoding))
    assert info.stored_type == stored
    assert values[2, 0, 1] == np.float32(largest) if stored == "float32" else largest
    assert any("rounded" in remark for remark in info.remarks) == (largest > 2**24)


@pytest.mark.parametrize("packed", [False, True])
def test_slabs_may_be_read_in_any_order(tmp_path, packed) -> None:
    from volprep_formats.progress import Silent
    from volprep_formats.readers import open_source
    from volprep_formats.source import SourceSpec

    values = noise(shape_zyx=(50, 60, 70))
    data = bz2.compress(values.tobytes()) if packed else values.tobytes()
    file = save(tmp_path / "v.nrrd", data=data, sizes="70 60 50", encoding="bz2" if packed else "raw")
    with open_source(SourceSpec(path=str(file)), Path(), Silent()) as source:
        for z0, z1 in [(30, 50), (0, 1), (40, 50), (1, 40), (2, 2)]:
            assert np.array_equal(source.read_slab(z0, z1), values[z0:z1])


@pytest.mark.parametrize(("encoding", "pack"), [("raw", bytes), ("gzip", gzip.compress)])
@pytest.mark.parametrize("key", ["data file", "datafile"])
def test_a_detached_data_file_is_read(tmp_path, encoding, pack, key) -> None:
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "v.dat").write_bytes(pack(noise().tobytes()))
    (tmp_path / "v.nhdr").write_bytes(header(encoding=encoding, **{key: "sub/v.dat"}).rstrip(b"\n"))
    values, _ = read(tmp_path / "v.nhdr")
    assert np.array_equal(values, noise())


def test_raw_data_that_begin_as_gzip_does_are_not_unpacked(tmp_path) -> None:
    values = noise("uint16")
    values[0, 0, 0] = 0x8B1F
    (tmp_path / "v.raw").write_bytes(values.tobytes())
    (tmp_path / "v.nhdr").write_bytes(header(type="ushort", data_file="v.raw"))
    assert np.array_equal(read(tmp_path / "v.nhdr")[0], values)


@pytest.mark.parametrize(
    "name", ["../secret", "/etc/passwd", "link", "sub/../../secret", "missing", ".", "a\0b", "x" * 999]
)
def test_a_detached_file_outside_the_folder_or_missing_is_refused(tmp_path, name) -> None:
    folder = tmp_path / "folder"
    (folder / "sub").mkdir(parents=True)
    (tmp_path / "secret").write_bytes(noise().tobytes())
    (folder / "link").symlink_to(tmp_path / "secret")
    (folder / "v.nhdr").write_bytes(header(data_file=name))
    error = refusal_at_open(folder / "v.nhdr")
    assert error.code == "VP1006"
    assert ("missing" in str(error)) == (name == "missing")


@pytest.mark.parametrize("value", ["LIST", "LIST 2\na.raw\nb.raw", "slice%03d.raw 1 3 1"])
def test_data_in_several_files_are_refused(tmp_path, value) -> None:
    (tmp_path / "v.nhdr").write_bytes(header(data_file=value))
    assert refusal_at_open(tmp_path / "v.nhdr").code == "VP1102"


def test_lines_and_bytes_before_the_data_are_skipped(tmp_path) -> None:
    raw = noise().tobytes()
    file = save(tmp_path / "v.nrrd", data=b"first\nsecond\nxyz" + raw, line_skip="2", byteskip="3")
    assert np.array_equal(read(file)[0], noise())
    # In a packed file the lines come before the stream, and the bytes are in it.
    packed = b"first\n" + gzip.compress(b"xyz" + raw)
    file = save(tmp_path / "v.nrrd", data=packed, lineskip="1", byte_skip="3", encoding="gzip")
    assert np.array_equal(read(file)[0], noise())


def test_a_byte_skip_of_minus_one_takes_the_end_of_the_file(tmp_path) -> None:
    file = save(tmp_path / "v.nrrd", data=b"of any length" + noise().tobytes(), byte_skip="-1")
    assert np.array_equal(read(file)[0], noise())
    assert refusal_at_open(save(file, data=gzip.compress(bytes(24)), byte_skip="-1", encoding="gz")).code == "VP1102"
    assert refusal_at_open(save(file, data=bytes(10), byte_skip="-1", sizes="400 10 30")).code == "VP1008"


@pytest.mark.parametrize("place", [0, 1, 3])
@pytest.mark.parametrize("kind", ["vector", "RGB-color", "list", "time"])
def test_an_axis_of_several_values_is_refused_by_its_number_and_kind(tmp_path, place, kind) -> None:
    sizes, vectors, kinds = ["4", "1", "3"], ["(1,0,0)", "(0,1,0)", "(0,0,1)"], ["domain"] * 3
    for values, value in ((sizes, "2"), (vectors, "none"), (kinds, kind)):
        values.insert(place, value)
    told = {"dimension": "4", "sizes": " ".join(sizes), "kinds": " ".join(kinds), "data": noise().tobytes() * 2}
    file = save(tmp_path / "v.nrrd", space_directions=" ".join(vectors), **told)
    error = refusal_at_open(file)
    assert error.code == "VP1101"
    assert f"axis {place + 1} " in str(error)
    assert kind.lower() in str(error)
    assert refusal_at_open(save(file, ORIENTATION, **told)).code == "VP1101"


@pytest.mark.parametrize("place", [0, 1, 3])
def test_an_axis_of_one_value_that_is_not_in_space_is_dropped(tmp_path, place) -> None:
    sizes, vectors = ["4", "1", "3"], ["(2,0,0)", "(0,3,0)", "(0,0,4)"]
    sizes.insert(place, "1")
    vectors.insert(place, "none")
    file = save(
        tmp_path / "v.nrrd", ["kinds"], dimension="4", sizes=" ".join(sizes), space_directions=" ".join(vectors)
    )
    values, info = read(file)
    assert np.array_equal(values, noise())
    assert info.grid.spacing_mm_zyx == (4, 3, 2)


@pytest.mark.parametrize("encoding", ["raw", "gzip", "ascii"])
@pytest.mark.parametrize(
    ("place", "kinds"), [(0, "list domain domain domain"), (3, "domain domain domain time"), (3, None)]
)
def test_one_of_several_volumes_is_read(tmp_path, place, kinds, encoding) -> None:
    several = np.stack([noise(), noise() + 100, noise() + 200], axis=3 if place == 0 else 0)
    sizes = [4, 1, 3]
    sizes.insert(place, 3)
    data = {"raw": bytes, "gzip": gzip.compress, "ascii": lambda _: " ".join(map(str, several.ravel())).encode()}
    told = {"dimension": "4", "sizes": " ".join(map(str, sizes)), "encoding": encoding}
    told |= {} if kinds is None else {"kinds": kinds}
    without = ORIENTATION if kinds else (*ORIENTATION, "kinds")
    file = save(tmp_path / "v.nrrd", without, data=data[encoding](several.tobytes()), **told)
    for volume in (1, 2, 3):
        values, _ = read(file, volume=volume)
        assert np.array_equal(values, noise() + 100 * (volume - 1))
    for wanted, code in ((4, "VP1021"), (None, "VP1101")):
        assert refusal_at_open(file, volume=wanted).code == code


def test_volumes_along_an_axis_within_space_are_refused(tmp_path) -> None:
    told = {"dimension": "4", "sizes": "4 2 1 3", "kinds": "domain list domain domain"}
    file = save(tmp_path / "v.nrrd", ORIENTATION, data=noise().tobytes() * 2, **told)
    assert refusal_at_open(file, volume=1).code == "VP1102"


def test_a_volume_of_a_file_of_one_is_refused_beyond_it(tmp_path) -> None:
    assert refusal_at_open(save(tmp_path / "v.nrrd"), volume=2).code == "VP1021"


def test_a_sound_file_of_fewer_or_more_axes_is_not_called_invalid(tmp_path) -> None:
    file = tmp_path / "v.nrrd"
    nrrd.write(str(file), np.zeros((4, 3), np.uint8))
    error = refusal_at_open(file)
    assert (error.code, "4×3 values with 2 axes" in error.summary) == ("VP1308", True)
    nrrd.write(str(file), np.zeros((4, 3, 2, 5), np.uint8))
    error = refusal_at_open(file)
    assert (error.code, "axis 4" in error.summary) == ("VP1101", True)


@pytest.mark.parametrize(
    ("code", "fields"),
    [
        ("VP1100", {"dimension": "2"}),
        ("VP1100", {"dimension": "0"}),
        ("VP1100", {"dimension": "99"}),
        ("VP1100", {"sizes": "4 -1 3"}),
        ("VP1100", {"sizes": "4 0 3"}),
        ("VP1100", {"sizes": "4 1 3.0"}),
        ("VP1100", {"sizes": "4 1 1_0"}),
        ("VP1100", {"sizes": "4 1 99999999999999999999999"}),
        ("VP1100", {"kinds": "domain domain"}),
        ("VP1100", {"endian": "middle"}),
        ("VP1100", {"space directions": "(1,0) (0,1) (0,0)"}),
        ("VP1100", {"space directions": "(1,0,0) (0,1,0)"}),
        ("VP1100", {"space directions": "(1,0,0) (0,x,0) (0,0,1)"}),
        ("VP1308", {"space directions": "(1,0,0) (0,1,0) none"}),
        ("VP1102", {"encoding": "hex"}),
        ("VP1102", {"encoding": "zstd"}),
        ("VP1102", {"type": "block"}),
        ("VP1102", {"type": "half"}),
        ("VP1103", {"space": "3D-left-handed"}),
        ("VP1103", {"space": "right-anterior-superior-time"}),
        ("VP1103", {"space units": '"parsec" "mm" "mm"'}),
        ("VP2020", {"space directions": "(1,0,0) (0.1,1,0) (0,0,1)"}),
        ("VP2021", {"space directions": "(1,0,0) (0,0,0) (0,0,1)"}),
        ("VP2021", {"space directions": "(1,0,0) (0,nan,0) (0,0,1)"}),
        ("VP2021", {"space directions": "(1,0,0) (0,1e300,0) (0,0,1)"}),
        ("VP2021", {"space origin": "(inf,0,0)"}),
    ],
)
def test_headers_that_cannot_be_trusted_are_refused(tmp_path, code, fields) -> None:
    error = refusal_at_open(save(tmp_path / "v.nrrd", **fields))
    assert error.code == code


@pytest.mark.parametrize("name", ["type", "dimension", "sizes", "endian", "encoding"])
def test_a_field_that_is_needed_and_missing_is_refused(tmp_path, name) -> None:
    assert refusal_at_open(save(tmp_path / "v.nrrd", [name])).code in {"VP1100", "VP1102"}


def test_spacings_that_would_have_to_be_guessed_are_refused(tmp_path) -> None:
    file = save(tmp_path / "v.nrrd", ORIENTATION, **{"axis mins": "0 0 0", "axis maxs": "1 1 1"})
    assert refusal_at_open(file).code == "VP1103"


def test_a_shear_is_refused_with_its_angle(tmp_path) -> None:
    error = refusal_at_open(save(tmp_path / "v.nrrd", space_directions="(1,0,0) (0.08748866,1,0) (0,0,1)"))
    assert "5.000°" in str(error)


def test_quantised_values_are_remarked(tmp_path) -> None:
    _, info = read(save(tmp_path / "v.nrrd", **{"old min": "0", "old max": "1"}))
    assert any("quantised" in remark for remark in info.remarks)


def test_nothing_that_could_name_a_patient_is_kept(tmp_path) -> None:
    file = save(tmp_path / "v.nrrd", content="CANARY", labels='"CANARY" "" ""', **{"DICOM_PatientName:": "=CANARY"})
    assert b"CANARY" in file.read_bytes()
    _, info = read(file)
    assert "CANARY" not in info.model_dump_json()


@pytest.mark.parametrize(
    "sizes", ["2000000000 2000000000 2000000000", "100000 100000 1", "4294967296 4294967296 1", "4 1 4"]
)
@pytest.mark.parametrize("encoding", ["raw", "gzip", "bzip2", "ascii"])
def test_declared_sizes_beyond_the_file_are_refused_before_anything_is_allocated(tmp_path, sizes, encoding) -> None:
    data = {"raw": noise().tobytes(), "gzip": gzip.compress(bytes(24)), "bzip2": bz2.compress(bytes(24))}
    file = save(tmp_path / "v.nrrd", data=data.get(encoding, b"1 " * 12), encoding=encoding, sizes=sizes)
    error = refusal(file) if sizes == "4 1 4" else refusal_at_open(file)
    assert error.code in {"VP1008", "VP1100"}


@pytest.mark.parametrize("encoding", ["raw", "gzip", "bzip2", "ascii"])
def test_data_beyond_the_declared_size_are_refused(tmp_path, encoding) -> None:
    data = {"raw": bytes(25), "gzip": gzip.compress(bytes(25)), "bzip2": bz2.compress(bytes(25))}
    file = save(tmp_path / "v.nrrd", data=data.get(encoding, b"1 " * 13), encoding=encoding)
    assert refusal(file).code == "VP1008"


@pytest.mark.parametrize(
    "head",
    [
        b"NRRD",
        b"NRRD0009\ntype: short\n\n",
        b"NRRD0005\n\n",
        b"NRRD0005\n" + b"#" * 2**21,
        b"NRRD0005\ntype: short\ntype: short\n\n",
        b"NRRD0005\nno field\n\n",
        b"NRRD0005\ntype: short\ndimension: 3\nsizes: 1 1 1\n",
    ],
)
def test_a_header_that_is_none_is_refused(tmp_path, head) -> None:
    (tmp_path / "v.nrrd").write_bytes(head)
    assert refusal_at_open(tmp_path / "v.nrrd").code == "VP1100"


@pytest.mark.parametrize(("encoding", "pack"), [("raw", bytes), ("gzip", gzip.compress), ("bzip2", bz2.compress)])
def test_every_cut_is_refused(tmp_path, encoding, pack) -> None:
    check_every_cut(save(tmp_path / "v.nrrd", data=pack(noise().tobytes()), encoding=encoding))


def test_damaged_streams_are_refused(tmp_path) -> None:
    for encoding, pack in (("gzip", gzip.compress), ("bzip2", bz2.compress)):
        data = bytearray(pack(np.random.default_rng(0).bytes(24)))
        data[-10] ^= 0xFF
        assert refusal(save(tmp_path / "v.nrrd", data=bytes(data), encoding=encoding)).code == "VP1005"


def test_a_fourth_axis_of_one_value_without_a_kind_is_dropped(tmp_path) -> None:
    values, _ = read(save(tmp_path / "v.nrrd", (*ORIENTATION, "kinds"), dimension="4", sizes="4 1 3 1"))
    assert np.array_equal(values, noise())


@pytest.mark.parametrize("space", ["3D-right-handed", "left-posterior-superior", "right-anterior-superior"])
def test_a_space_that_does_not_say_how_the_axes_lie_is_remarked(tmp_path, space) -> None:
    without = () if space.startswith("3D") else ("space directions",)
    _, info = read(save(tmp_path / "v.nrrd", without, space=space))
    assert np.array_equal(info.grid.direction, np.eye(3))
    assert any("does not say how the volume lies" in remark for remark in info.remarks)


def test_the_oblique_head_lies_where_its_nifti_twin_does(scans) -> None:
    values, info = read(scans / "flair_pair" / "FLAIR.nrrd")
    twin, twin_info = read(scans / "flair_pair" / "FLAIR.nii.gz")
    assert values.dtype == twin.dtype == np.uint8
    assert np.array_equal(values, twin)
    ends = np.array(np.meshgrid(*((0, n - 1) for n in values.shape[::-1]), 1)).reshape(4, -1)
    apart = info.grid.world_from_index @ ends - twin_info.grid.world_from_index @ ends
    assert np.abs(apart).max() < 1e-4
    independent, _ = nrrd.read(str(scans / "flair_pair" / "FLAIR.nrrd"), index_order="C")
    assert np.array_equal(values, independent)


def test_layers_of_a_segmentation_may_be_followed_by_an_axis_of_one(tmp_path) -> None:
    told = {"dimension": "5", "sizes": "2 4 1 3 1", "kinds": "list domain domain domain ???"}
    told["space_directions"] = "none (2,0,0) (0,3,0) (0,0,4) none"
    layered = open_layers(save(tmp_path / "v.nrrd", data=noise().tobytes() * 2, **told), 64)
    layered.voxels.close()
    assert (layered.volumes, layered.grid.shape_zyx) == (2, (3, 1, 4))
