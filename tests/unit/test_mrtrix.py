"""MRtrix images: places in LPS, orders of axes, types, volumes, and what is refused."""

import gzip
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest
from header_files import read, refusal, refusal_at_open

from volprep_formats.readers import format_of

SHAPE_XYZ = (5, 4, 3)
AFFINE = np.array([[0.0, -2.0, 0.0, 7.0], [1.5, 0.0, 0.0, -6.0], [0.0, 0.0, 3.0, 5.0]])
"""From indices of the image to RAS."""
SPACING = (1.5, 2.0, 3.0)
FIELDS = {
    "dim": "5,4,3",
    "vox": "1.5,2,3",
    "layout": "+0,+1,+2",
    "datatype": "Int16LE",
    "transform": "0,-1,0,7\ntransform: 1,0,0,-6\ntransform: 0,0,1,5",
    "comments": "DOE, JANE",
}


def image(count: int = 1) -> np.ndarray:
    """Values [x, y, z, volume], different everywhere."""
    return np.arange(count * np.prod(SHAPE_XYZ)).reshape(*SHAPE_XYZ, count).astype(np.int16)


def save(path: Path, data: bytes, without: tuple[str, ...] = (), **fields: str) -> Path:
    told = {name: value for name, value in (FIELDS | fields).items() if name not in without}
    lines = [f"{name}: {value}" for name, value in told.items()]
    head = "\n".join(["mrtrix image", *lines, "file: . 600", "END", ""]).encode()
    whole = head.ljust(600, b"\0") + data
    path.write_bytes(gzip.compress(whole) if path.suffix == ".gz" else whole)
    return path


def stored(values: np.ndarray, layout: list[str]) -> bytes:
    """The values of an image in the order that its layout says."""
    for axis, word in enumerate(layout):
        values = np.flip(values, axis) if word[0] == "-" else values
    slowest_first = sorted(range(len(layout)), key=lambda axis: -int(layout[axis][1:]))
    return values.transpose(slowest_first).tobytes()


@pytest.mark.parametrize("suffix", [".mif", ".mif.gz"])
@pytest.mark.parametrize("ranks", list(permutations("012")))
@pytest.mark.parametrize("signs", ["+++", "-++", "-+-"])
def test_every_voxel_lies_where_transform_and_layout_put_it(tmp_path, ranks, signs, suffix) -> None:
    layout = [sign + rank for sign, rank in zip(signs, ranks, strict=True)]
    path = save(tmp_path / f"a{suffix}", stored(image()[..., 0], layout), layout=",".join(layout))
    assert format_of(path) == "mrtrix"
    values, info = read(path)
    lps = np.diag([-1.0, -1.0, 1.0]) @ AFFINE
    for index in np.ndindex(values.shape):
        place = info.grid.world_from_index @ [*reversed(index), 1.0]
        at = np.linalg.solve(lps[:, :3], place[:3] - lps[:, 3])
        assert values[index] == image()[*np.rint(at).astype(int), 0]


@pytest.mark.parametrize("layout", ["+0,+1,+2,+3", "+1,+2,+3,+0", "-0,+1,+2,-3"])
def test_one_of_several_volumes_is_read(tmp_path, layout) -> None:
    told = {"dim": "5,4,3,2", "vox": "1.5,2,3,nan", "layout": layout}
    path = save(tmp_path / "a.mif", stored(image(2), layout.split(",")), **told)
    for volume in (1, 2):
        values, _ = read(path, volume=volume)
        assert sorted(values.ravel()) == sorted(image(2)[..., volume - 1].ravel())
    assert refusal_at_open(path).code == "VP1021"
    assert refusal_at_open(path, volume=3).code == "VP1021"


@pytest.mark.parametrize(
    ("datatype", "dtype"),
    [("UInt8", "u1"), ("Int8", "i1"), ("UInt16BE", ">u2"), ("Float32LE", "<f4"), ("Int32", "<i4")],
)
def test_types_byte_orders_and_scaling_are_read(tmp_path, datatype, dtype) -> None:
    data = image()[..., 0].astype(dtype).transpose(2, 1, 0)
    values, info = read(save(tmp_path / "a.mif", data.tobytes(), datatype=datatype, scaling="-10,0.5"))
    assert np.array_equal(values, data)
    assert (info.slope, info.intercept) == (0.5, -10.0)


def test_a_file_without_a_transform_is_centred_and_remarked(tmp_path) -> None:
    _, info = read(save(tmp_path / "a.mif", image().tobytes(), ("transform",)))
    assert info.grid.origin_mm_xyz == (3.0, 3.0, -3.0)
    assert any("does not say how the volume lies" in remark for remark in info.remarks)


def test_a_header_with_a_data_file_is_read_and_none_leads_out_of_the_folder(tmp_path) -> None:
    head = "\n".join(["mrtrix image", *(f"{name}: {value}" for name, value in FIELDS.items())])
    (tmp_path / "a.dat").write_bytes(b"xx" + image().tobytes())
    (tmp_path / "a.mih").write_text(f"{head}\nfile: a.dat 2\nEND\n")
    values, _ = read(tmp_path / "a.mih")
    assert np.array_equal(values.ravel(), image().ravel())
    (tmp_path / "a.mih").write_text(f"{head}\nfile: ../a.dat 2\nEND\n")
    assert refusal_at_open(tmp_path / "a.mih").code == "VP1006"


@pytest.mark.parametrize(
    ("code", "fields"),
    [
        ("VP1308", {"dim": "5,4", "layout": "+0,+1", "vox": "1,1"}),
        ("VP1291", {"dim": "5,4,x"}),
        ("VP1291", {"layout": "+0,+1,+1"}),
        ("VP1291", {"layout": "+0,+1"}),
        ("VP1291", {"vox": "1,1"}),
        ("VP1291", {"transform": "1,0,0,0"}),
        ("VP1291", {"scaling": "0,0"}),
        ("VP1291", {"scaling": "nan,1"}),
        ("VP1292", {"datatype": "Bit"}),
        ("VP1292", {"datatype": "CFloat32LE"}),
        ("VP1292", {"dim": "5,4,3,2,2", "layout": "+0,+1,+2,+3,+4", "vox": "1,1,1,1,1"}),
        ("VP1292", {"dim": "5,4,3,2", "layout": "+0,+1,+3,+2", "vox": "1,1,1,1"}),
        ("VP2021", {"vox": "0,1,1"}),
        ("VP2021", {"vox": "inf,1,1"}),
        ("VP1008", {"dim": "50,40,30"}),
        ("VP1008", {"dim": "4,4,3"}),
    ],
)
def test_headers_that_cannot_be_trusted_are_refused(tmp_path, code, fields) -> None:
    file = save(tmp_path / "a.mif", image().tobytes(), **fields)
    assert refusal_at_open(file, volume=1 if "+3" in fields.get("layout", "") else None).code == code


def test_a_cut_file_is_refused(tmp_path) -> None:
    whole = save(tmp_path / "a.mif.gz", image().tobytes()).read_bytes()
    for size in range(12, len(whole), 7):
        (tmp_path / "a.mif.gz").write_bytes(whole[:size])
        assert refusal(tmp_path / "a.mif.gz").code in {"VP1002", "VP1005", "VP1008", "VP1291"}


def test_nothing_that_could_name_a_patient_is_kept(tmp_path) -> None:
    _, info = read(save(tmp_path / "a.mif", image().tobytes()))
    assert "DOE" not in info.model_dump_json()
