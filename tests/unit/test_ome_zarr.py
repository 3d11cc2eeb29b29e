"""OME-Zarr stores, written by zarr, in folders and zips."""

import json
import os
import stat
import zipfile

import numcodecs
import numpy as np
import pytest
import zarr
from zarr_stores import multiscales, write_store, zipped

from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.source import SourceSpec

pytestmark = pytest.mark.usefixtures("kept_workers")

SIZES = {"t": 2, "c": 3, "z": 5, "y": 7, "x": 6}
CHUNKS = {"t": 1, "c": 1, "z": 2, "y": 3, "x": 4}
LABELS = ("DAPI", "GFP", "RFP")
TYPES = ("uint8", "int8", "uint16", "int16", "uint32", "int64", "float16", "float32", "float64")
V2_CODECS = (numcodecs.Zlib(), numcodecs.Blosc("lz4"), numcodecs.BZ2(), numcodecs.LZMA(), numcodecs.LZ4(), None)
V3_CODECS = ([zarr.codecs.GzipCodec()], [zarr.codecs.BloscCodec(), zarr.codecs.Crc32cCodec()], [])


def noise(axes: str = "zyx", dtype: str = "uint16") -> np.ndarray:
    return np.random.default_rng(5).integers(0, 250, [SIZES[axis] for axis in axes]).astype(dtype)


def store(folder, axes="zyx", version=3, dtype="uint16", told=None, **array):
    values = noise(axes, dtype)
    array.setdefault("chunks", tuple(CHUNKS[axis] for axis in axes))
    labels = LABELS if "c" in axes else ()
    write_store(folder, [values], told or multiscales(axes), version, labels=labels, **array)
    return values


def read(path, **spec):
    with open_source(SourceSpec(path=str(path), **spec), path.parent, Silent()) as source:
        info, depth = source.info, source.info.grid.shape_zyx[0]
        assert info.format == "ome-zarr"
        parts = [source.read_slab(z0, min(z0 + 3, depth)) for z0 in range(0, depth, 3)]
        whole = np.concatenate(parts)
        assert np.array_equal(source.read_slab(0, 1), whole[:1])
        assert (whole.dtype, whole.shape) == (np.dtype(info.stored_type), info.grid.shape_zyx)
        return info, whole


def refusal(path, **spec) -> VolprepError:
    with pytest.raises(VolprepError) as error:
        read(path, **spec)
    return error.value


def change(file, edit) -> None:
    """Edit a JSON file."""
    document = json.loads(file.read_text())
    edit(document)
    file.write_text(json.dumps(document))


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("axes", ["tczyx", "czyx", "tzyx", "zyx", "yx", "cyx", "xyz"])
def test_one_channel_and_time_point_is_read(tmp_path, version, axes) -> None:
    values = store(tmp_path / "a.zarr", axes, version)
    choice = {"channel": 2} if "c" in axes else {}
    choice |= {"volume": 2} if "t" in axes else {}
    info, voxels = read(tmp_path / "a.zarr", **choice)
    for name in "tc":
        if name in axes:
            values = values[1]
    if axes == "xyz":
        values = values.T
    assert np.array_equal(voxels, values.reshape(info.grid.shape_zyx))


def test_a_zip_is_read_at_its_root_and_below_a_folder(tmp_path) -> None:
    values = store(tmp_path / "a.zarr")
    assert np.array_equal(read(zipped(tmp_path / "a.zarr", tmp_path / "a.zarr.zip"))[1], values)
    assert np.array_equal(read(zipped(tmp_path / "a.zarr", tmp_path / "b.zarr.zip", "x.zarr/"))[1], values)


@pytest.mark.parametrize(
    "dtype", ["uint8", "int8", "uint16", "int16", "uint32", "int64", "float16", "float32", "float64"]
)
def test_every_type_becomes_the_smallest_that_holds_it(tmp_path, dtype) -> None:
    values = store(tmp_path / "a.zarr", dtype=dtype)
    stored = {
        "int8": "int16",
        "uint32": "uint8",
        "int64": "uint8" if values.min() >= 0 else "int16",
        "float16": "float32",
    }
    info, voxels = read(tmp_path / "a.zarr")
    assert np.array_equal(voxels, values)
    assert info.stored_type == stored.get(dtype, "float32" if dtype == "float64" else dtype)


def test_big_endian_values_are_turned(tmp_path) -> None:
    values = store(tmp_path / "a.zarr", version=2, dtype=">i2")
    assert np.array_equal(read(tmp_path / "a.zarr")[1], values)


@pytest.mark.parametrize(
    "codec",
    [
        numcodecs.Zlib(),
        numcodecs.Blosc("lz4"),
        numcodecs.BZ2(),
        numcodecs.LZMA(),
        numcodecs.LZ4(),
        numcodecs.Zstd(),
        None,
    ],
    ids=str,
)
def test_every_codec_of_version_2_is_unpacked(tmp_path, codec) -> None:
    values = store(tmp_path / "a.zarr", version=2, compressors=codec, filters=[numcodecs.Delta(dtype="u2")], order="F")
    assert np.array_equal(read(tmp_path / "a.zarr")[1], values)


@pytest.mark.parametrize(
    "codecs",
    [[zarr.codecs.GzipCodec()], [zarr.codecs.BloscCodec(), zarr.codecs.Crc32cCodec()], []],
    ids=["gzip", "blosc", "none"],
)
def test_every_codec_of_version_3_is_unpacked(tmp_path, codecs) -> None:
    transpose = zarr.codecs.TransposeCodec(order=(2, 0, 1))
    values = store(tmp_path / "a.zarr", compressors=codecs, filters=[transpose])
    assert np.array_equal(read(tmp_path / "a.zarr")[1], values)


def test_shards_are_read(tmp_path) -> None:
    values = store(tmp_path / "a.zarr", shards=(4, 6, 8))
    assert np.array_equal(read(tmp_path / "a.zarr")[1], values)


def test_thin_slabs_of_thick_chunks_are_right_whether_or_not_rows_are_kept(tmp_path, monkeypatch) -> None:
    from volprep_formats.readers.ome import zarr_image as ome_zarr

    values = store(tmp_path / "a.zarr", chunks=(4, 3, 4))
    monkeypatch.setattr(ome_zarr, "_PART_BYTES", 60)
    monkeypatch.setattr(ome_zarr, "_ROW_BYTES", 1)
    assert np.array_equal(read(tmp_path / "a.zarr")[1], values)
    monkeypatch.setattr(ome_zarr, "_KEPT_BYTES", 10)
    assert np.array_equal(read(tmp_path / "a.zarr")[1], values)


def test_scale_and_translation_place_the_voxels_in_millimetres(tmp_path) -> None:
    told = multiscales("czyx", scale=(1, 2.0, 0.5, 0.25), shift=(0, 10.0, 20.0, 30.0))
    store(tmp_path / "a.zarr", "czyx", told=told)
    grid = read(tmp_path / "a.zarr", channel="RFP")[0].grid
    assert np.allclose(grid.spacing_mm_zyx, (2e-3, 0.5e-3, 0.25e-3), rtol=1e-12)
    assert np.allclose(grid.origin_mm_xyz, (30e-3, 20e-3, 10e-3), rtol=1e-12)


def test_transformations_of_all_levels_come_after_those_of_one(tmp_path) -> None:
    told = multiscales("zyx", scale=(2.0, 1.0, 1.0), shift=(5.0, 0.0, 0.0))
    told["coordinateTransformations"] = [{"type": "scale", "scale": [10.0, 1.0, 1.0]}]
    store(tmp_path / "a.zarr", told=told)
    grid = read(tmp_path / "a.zarr")[0].grid
    assert np.isclose(grid.spacing_mm_zyx[0], 20e-3, rtol=1e-12)
    assert np.isclose(grid.origin_mm_xyz[2], 50e-3, rtol=1e-12)


@pytest.mark.parametrize(
    ("unit", "mm"), [("millimeter", 1.0), ("nanometer", 1e-6), ("meter", 1000.0), ("angstrom", 1e-7)]
)
def test_every_unit_of_length_becomes_millimetres(tmp_path, unit, mm) -> None:
    told = multiscales("zyx")
    for axis in told["axes"]:
        axis["unit"] = unit
    store(tmp_path / "a.zarr", told=told)
    assert np.allclose(read(tmp_path / "a.zarr")[0].grid.spacing_mm_zyx, mm, rtol=1e-12)


def test_without_a_unit_millimetres_are_taken_and_said(tmp_path) -> None:
    told = multiscales("zyx", scale=(3.0, 2.0, 1.0))
    del told["axes"][1]["unit"], told["axes"][0]["unit"], told["axes"][2]["unit"]
    store(tmp_path / "a.zarr", told=told)
    info = read(tmp_path / "a.zarr")[0]
    assert info.grid.spacing_mm_zyx == (3.0, 2.0, 1.0)
    assert "millimetres are assumed" in info.remarks[0]


def test_the_finest_level_is_read_unless_another_is_chosen(tmp_path) -> None:
    values = noise()
    coarse = values[::2, ::2, ::2]
    write_store(tmp_path / "a.zarr", [values, coarse], multiscales("zyx", 2, (1.0, 1.0, 1.0)), 3, chunks=(2, 2, 2))
    assert np.array_equal(read(tmp_path / "a.zarr")[1], values)
    info, voxels = read(tmp_path / "a.zarr", level=1)
    assert np.array_equal(voxels, coarse)
    assert np.allclose(info.grid.spacing_mm_zyx, 2e-3)
    assert refusal(tmp_path / "a.zarr", level=2).code == "VP1222"


def test_several_channels_or_times_without_a_choice_are_refused_with_their_names(tmp_path) -> None:
    store(tmp_path / "a.zarr", "tczyx")
    error = refusal(tmp_path / "a.zarr", volume=1)
    assert (error.code, error.fields["key"]) == ("VP1221", "channel")
    assert "1: 'DAPI'\n  2: 'GFP'\n  3: 'RFP'" in str(error)
    assert refusal(tmp_path / "a.zarr", channel="GFP").fields["key"] == "volume"
    assert refusal(tmp_path / "a.zarr", channel="gfp", volume=1).code == "VP1222"


@pytest.mark.parametrize("version", [2, 3])
def test_a_missing_chunk_is_the_fill_value(tmp_path, version) -> None:
    values = store(tmp_path / "a.zarr", version=version, fill_value=7)
    chunk = tmp_path / "a.zarr" / "0" / ("0.0.0" if version == 2 else "c/0/0/0")
    chunk.unlink()
    values[:2, :3, :4] = 7
    assert np.array_equal(read(tmp_path / "a.zarr")[1], values)


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("packed", [True, False])
def test_a_chunk_that_ends_too_early_is_refused(tmp_path, version, packed) -> None:
    codec = (numcodecs.Zlib() if version == 2 else zarr.codecs.GzipCodec()) if packed else None
    store(tmp_path / "a.zarr", version=version, compressors=codec)
    chunk = tmp_path / "a.zarr" / "0" / ("1.1.1" if version == 2 else "c/1/1/1")
    chunk.write_bytes(chunk.read_bytes()[:-5])
    assert refusal(tmp_path / "a.zarr").code == "VP1220"


@pytest.mark.parametrize("name", ["../out", "/etc", "a/../../b", "..", ".", "", "a//b", "a\\b", "c:b", "a\0b"])
def test_a_dataset_outside_of_the_store_is_refused(tmp_path, name) -> None:
    write_store(tmp_path / "out", [noise()], multiscales("zyx"), 3)
    store(tmp_path / "a.zarr")
    change(
        tmp_path / "a.zarr" / "zarr.json",
        lambda root: root["attributes"]["ome"]["multiscales"][0]["datasets"][0].update(path=name),
    )
    assert refusal(tmp_path / "a.zarr").code == "VP1226"


@pytest.mark.parametrize("what", ["0", "0/zarr.json", "0/c", "0/c/1/1/1", "zarr.json"])
def test_a_link_out_of_the_store_is_refused(tmp_path, what) -> None:
    store(tmp_path / "a.zarr")
    target = tmp_path / "a.zarr" / what
    target.rename(tmp_path / "elsewhere")
    target.symlink_to(tmp_path / "elsewhere")
    assert refusal(tmp_path / "a.zarr", format="ome-zarr").code == "VP1226"


def test_a_link_within_the_store_is_followed(tmp_path) -> None:
    values = store(tmp_path / "a.zarr")
    (tmp_path / "a.zarr" / "0").rename(tmp_path / "a.zarr" / "real")
    (tmp_path / "a.zarr" / "0").symlink_to("real")
    assert np.array_equal(read(tmp_path / "a.zarr")[1], values)


def test_a_chunk_that_is_no_file_is_missing_and_is_not_waited_for(tmp_path) -> None:
    values = store(tmp_path / "a.zarr")
    chunk = tmp_path / "a.zarr" / "0/c/0/0/0"
    chunk.unlink()
    os.mkfifo(chunk)
    values[:2, :3, :4] = 0
    assert np.array_equal(read(tmp_path / "a.zarr")[1], values)


def zip_with(tmp_path, entry: zipfile.ZipInfo, data: bytes = b"x", compression: int = zipfile.ZIP_STORED):
    """A sound store in a zip, but for one entry that is added, or replaced."""
    store(tmp_path / "a.zarr", compressors=None)
    file = tmp_path / "b.zarr.zip"
    with (
        zipfile.ZipFile(zipped(tmp_path / "a.zarr", tmp_path / "a.zip")) as sound,
        zipfile.ZipFile(file, "w") as output,
    ):
        for name in sound.namelist():
            if name != entry.filename:
                output.writestr(zipfile.ZipInfo(name), sound.read(name))
        output.writestr(entry, data, compress_type=compression)
    return file


@pytest.mark.parametrize("name", ["../evil", "/evil", "a/../../evil", "a/./b", "c:\\evil"])
def test_a_zip_with_a_name_that_leads_out_is_refused(tmp_path, name) -> None:
    assert refusal(zip_with(tmp_path, zipfile.ZipInfo(name))).code == "VP1226"


def test_a_zip_with_a_link_is_refused(tmp_path) -> None:
    entry = zipfile.ZipInfo("0/c/0/0/0")
    entry.external_attr = (stat.S_IFLNK | 0o777) << 16
    assert refusal(zip_with(tmp_path, entry, b"/etc/passwd")).code == "VP1226"


@pytest.mark.parametrize("name", ["zarr.json", "0/zarr.json", "0/c/0/0/0"])
def test_an_entry_that_unpacks_to_more_than_is_wanted_is_refused_before_it_does(tmp_path, name) -> None:
    file = zip_with(tmp_path, zipfile.ZipInfo(name), bytes(2**25), zipfile.ZIP_DEFLATED)
    assert file.stat().st_size < 2**17
    assert refusal(file).code == "VP1225"


def test_an_entry_that_unpacks_to_more_than_it_declares_is_refused(tmp_path) -> None:
    file = zip_with(tmp_path, zipfile.ZipInfo("0/c/0/0/0"), bytes(2**25), zipfile.ZIP_DEFLATED)
    data = file.read_bytes()
    declared = (2**25).to_bytes(4, "little")
    assert data.count(declared) == 2
    file.write_bytes(data.replace(declared, (48).to_bytes(4, "little")))
    assert refusal(file).code == "VP1220"


def test_an_entry_that_is_there_twice_is_refused(tmp_path) -> None:
    file = zip_with(tmp_path, zipfile.ZipInfo("0/c/0/0/0"), bytes(48))
    with zipfile.ZipFile(file, "a") as output, pytest.warns(UserWarning, match="Duplicate"):
        output.writestr(zipfile.ZipInfo("0/c/0/0/0"), bytes(48))
    assert "there twice" in str(refusal(file))


@pytest.mark.long(keep=1)
@pytest.mark.parametrize(
    "codec", [numcodecs.Zlib(), numcodecs.Zstd(), numcodecs.Blosc("zstd"), numcodecs.LZ4()], ids=str
)
def test_a_chunk_that_unpacks_to_gigabytes_is_stopped(tmp_path, codec) -> None:
    store(tmp_path / "a.zarr", version=2, compressors=codec)
    (tmp_path / "a.zarr/0/1.1.1").write_bytes(codec.encode(bytes(2**28)))
    assert refusal(tmp_path / "a.zarr").code in {"VP1220", "VP1225", "VP1270", "VP1272"}


EDITS = {
    "negative": (lambda array: array.update(shape=[-5, 7, 6]), "VP1220"),
    "zero": (lambda array: array.update(shape=[0, 7, 6]), "VP1220"),
    "fraction": (lambda array: array.update(shape=[5.0, 7, 6]), "VP1220"),
    "huge": (lambda array: array.update(shape=[2**12, 2**12, 2**11]), "VP1225"),
    "huge axis": (lambda array: array.update(shape=[2**31, 1, 1]), "VP1225"),
    "overflow": (lambda array: array.update(shape=[2**70, 7, 6]), "VP1220"),
    "huge chunks": (
        lambda array: array["chunk_grid"]["configuration"].update(chunk_shape=[2**20, 2**20, 2**20]),
        "VP1225",
    ),
    "no chunks": (lambda array: array["chunk_grid"]["configuration"].update(chunk_shape=[0, 3, 4]), "VP1220"),
    "axes of chunks": (lambda array: array["chunk_grid"]["configuration"].update(chunk_shape=[3, 4]), "VP1220"),
    "axes": (lambda array: array.update(shape=[5, 7]), "VP1220"),
    "other type": (lambda array: array.update(data_type="float64"), "VP1220"),
    "complex": (lambda array: array.update(data_type="complex64"), "VP1224"),
    "text": (lambda array: array.update(data_type="string"), "VP1224"),
    "pickle": (lambda array: array["codecs"].append({"name": "numcodecs.pickle", "configuration": {}}), "VP1224"),
    "unknown codec": (lambda array: array["codecs"].append({"name": "evil"}), "VP1224"),
    "grid": (lambda array: array["chunk_grid"].update(name="rectangular"), "VP1224"),
    "group": (lambda array: array.update(node_type="group"), "VP1220"),
    "nothing": (lambda array: array.clear(), "VP1220"),
}


def cubes(folder, shape: int, chunk: int):
    """A store of a cube in chunks that are cubes, all of them missing."""
    store(folder, compressors=None)
    grid = {"name": "regular", "configuration": {"chunk_shape": [chunk] * 3}}
    change(folder / "0/zarr.json", lambda array: array.update(shape=[shape] * 3, chunk_grid=grid))
    return folder


def test_many_chunks_of_a_few_voxels_are_refused_before_any_is_read(tmp_path) -> None:
    for shape, chunk, told in ((17, 1, "4913 chunks of 1 voxels"), (119, 7, "4913 chunks of 343 voxels")):
        error = refusal(cubes(tmp_path / f"{chunk}.zarr", shape, chunk))
        assert error.code == "VP1225"
        assert told in str(error)


def test_a_few_small_chunks_or_many_larger_ones_are_read(tmp_path) -> None:
    for shape, chunk in ((16, 1), (136, 8)):
        folder = cubes(tmp_path / f"{chunk}.zarr", shape, chunk)
        with open_source(SourceSpec(path=str(folder), missing="fill"), tmp_path, Silent()) as source:
            assert source.info.grid.shape_zyx == (shape, shape, shape)


@pytest.mark.parametrize("name", EDITS)
def test_what_an_array_may_not_say_is_refused(tmp_path, name) -> None:
    store(tmp_path / "a.zarr", compressors=None)
    edit, code = EDITS[name]
    change(tmp_path / "a.zarr/0/zarr.json", edit)
    assert refusal(tmp_path / "a.zarr").code == code


@pytest.mark.parametrize(
    ("edit", "code"),
    [
        ({"compressor": {"id": "pickle", "protocol": 5}}, "VP1224"),
        ({"filters": [{"id": "pickle"}]}, "VP1224"),
        ({"filters": [{"id": "json2"}]}, "VP1224"),
        ({"dtype": "|O"}, "VP1224"),
        ({"dtype": [["a", "<u2"]]}, "VP1224"),
        ({"dtype": "<U4"}, "VP1224"),
        ({"dtype": "nonsense"}, "VP1220"),
        ({"chunks": [2**30, 2**30, 1]}, "VP1225"),
        ({"shape": [-1, 7, 6]}, "VP1220"),
    ],
    ids=str,
)
def test_what_an_array_of_version_2_may_not_say_is_refused(tmp_path, edit, code) -> None:
    store(tmp_path / "a.zarr", version=2)
    change(tmp_path / "a.zarr/0/.zarray", lambda array: array.update(edit))
    assert refusal(tmp_path / "a.zarr").code == code


@pytest.mark.parametrize(
    ("edit", "code"),
    [
        (lambda scales: scales["axes"][0].update(unit="parsec"), "VP1224"),
        (lambda scales: scales["axes"][0].update(name="depth"), "VP1224"),
        (lambda scales: scales["axes"][0].update(type="channel"), "VP1221"),
        (lambda scales: scales["axes"].pop(), "VP1220"),
        (lambda scales: scales["axes"].__setitem__(0, scales["axes"][1]), "VP1220"),
        (lambda scales: scales["datasets"].clear(), "VP1220"),
        (lambda scales: scales["datasets"][0].update(path="9"), "VP1220"),
        (lambda scales: scales["datasets"][0].pop("coordinateTransformations"), "VP1220"),
        (lambda scales: scales["datasets"][0]["coordinateTransformations"][0].update(scale=[1, 1]), "VP1224"),
        (lambda scales: scales["datasets"][0]["coordinateTransformations"][0].update(scale=[0, 1, 1]), "VP1227"),
        (lambda scales: scales["datasets"][0]["coordinateTransformations"][0].update(scale=[-1, 1, 1]), "VP1227"),
        (lambda scales: scales["datasets"][0]["coordinateTransformations"][0].update(scale=[1e999, 1, 1]), "VP1220"),
        (lambda scales: scales["datasets"][0]["coordinateTransformations"][0].update(type="affine"), "VP1220"),
    ],
)
def test_what_an_image_may_not_say_is_refused(tmp_path, edit, code) -> None:
    store(tmp_path / "a.zarr")
    change(tmp_path / "a.zarr/zarr.json", lambda root: edit(root["attributes"]["ome"]["multiscales"][0]))
    assert refusal(tmp_path / "a.zarr").code == code


@pytest.mark.parametrize("version", ["0.3", "0.6", None])
def test_another_version_of_the_metadata_is_refused(tmp_path, version) -> None:
    store(tmp_path / "a.zarr")
    change(tmp_path / "a.zarr/zarr.json", lambda root: root["attributes"]["ome"].update(version=version))
    assert refusal(tmp_path / "a.zarr").code == "VP1224"


def test_a_store_without_an_image_is_refused(tmp_path) -> None:
    zarr.create_group(store=str(tmp_path / "a.zarr"))
    assert "multiscales" in str(refusal(tmp_path / "a.zarr"))


def test_metadata_that_are_nested_without_end_are_refused(tmp_path) -> None:
    store(tmp_path / "a.zarr")
    (tmp_path / "a.zarr/zarr.json").write_text("[" * 10**6)
    assert refusal(tmp_path / "a.zarr").code == "VP1220"


def test_of_several_numbered_images_one_is_chosen(tmp_path) -> None:
    root = zarr.create_group(store=str(tmp_path / "a.zarr"), zarr_format=2)
    root.attrs.update({"bioformats2raw.layout": 3})
    store(tmp_path / "a.zarr/0", version=2)
    values = store(tmp_path / "a.zarr/1", "xyz", version=2, dtype="uint8").T
    assert refusal(tmp_path / "a.zarr").fields["key"] == "series"
    assert np.array_equal(read(tmp_path / "a.zarr", series="2")[1], values)
    assert np.array_equal(read(tmp_path / "a.zarr/1")[1], values)


def chunk_files(folder) -> list:
    """Files of the chunks of level 0."""
    return sorted(file for file in (folder / "0").rglob("*") if file.is_file() and file.name[0].isdigit())


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("is_zip", [False, True])
@pytest.mark.parametrize(("count", "is_read"), [(1, True), (4, True), (5, False), (18, False)])
def test_chunks_that_are_missing_are_counted_and_too_many_refused(tmp_path, version, is_zip, count, is_read) -> None:
    folder = tmp_path / "a.zarr"
    store(folder, version=version, fill_value=7)
    chunks = chunk_files(folder)
    assert len(chunks) == 18
    for chunk in chunks[:count]:
        chunk.unlink()
    path = zipped(folder, tmp_path / "b.zarr.zip") if is_zip else folder
    if is_read:
        info, values = read(path)
        assert f"{count} of 18 chunks are missing and hold the fill value" in info.remarks
        assert (values == 7).sum() >= count
        return
    assert refusal(path).code == "VP1260"
    assert f"{count} of the 18" in str(refusal(path))
    _, values = read(path, missing="fill")
    assert count < 18 or (values == 7).all()


def test_a_shape_that_is_larger_than_the_data_is_refused(tmp_path) -> None:
    store(tmp_path / "a.zarr")
    change(tmp_path / "a.zarr/0/zarr.json", lambda array: array.update(shape=[9, 7, 6]))
    assert refusal(tmp_path / "a.zarr").code == "VP1260"


def test_shards_that_are_missing_are_counted(tmp_path) -> None:
    store(tmp_path / "a.zarr", shards=(2, 6, 8))
    shards = chunk_files(tmp_path / "a.zarr")
    for shard in shards[: len(shards) // 2]:
        shard.unlink()
    assert refusal(tmp_path / "a.zarr").code == "VP1260"


def test_chunks_of_another_channel_may_be_missing(tmp_path) -> None:
    values = store(tmp_path / "a.zarr", "czyx")
    for chunk in (tmp_path / "a.zarr/0/c/0").rglob("*"):
        if chunk.is_file():
            chunk.unlink()
    info, found = read(tmp_path / "a.zarr", channel=2)
    assert np.array_equal(found, values[1])
    assert not any("missing" in remark for remark in info.remarks)
    assert refusal(tmp_path / "a.zarr", channel=1).code == "VP1260"


def test_missing_is_a_key_of_ome_zarr_only(tmp_path) -> None:
    (tmp_path / "a.nrrd").write_bytes(b"NRRD0004\n")
    with pytest.raises(VolprepError, match=r"VP1004.*source\.missing"):
        open_source(SourceSpec(path=str(tmp_path / "a.nrrd"), missing="fill"), tmp_path, Silent())


OTHER_TYPES = ([], [1], "text", 7, 1.5, True, None, {}, [{}], {"ome": []}, {"ome": {"multiscales": 7}})


@pytest.mark.long(keep=6)
@pytest.mark.parametrize("other", OTHER_TYPES, ids=str)
@pytest.mark.parametrize(
    ("version", "name", "keys"),
    [
        (3, "zarr.json", ()),
        (3, "zarr.json", ("attributes",)),
        (3, "zarr.json", ("attributes", "ome")),
        (3, "zarr.json", ("attributes", "ome", "multiscales")),
        (3, "zarr.json", ("attributes", "ome", "multiscales", 0)),
        (3, "zarr.json", ("attributes", "ome", "multiscales", 0, "axes")),
        (3, "zarr.json", ("attributes", "ome", "multiscales", 0, "datasets", 0)),
        (3, "0/zarr.json", ()),
        (3, "0/zarr.json", ("shape",)),
        (3, "0/zarr.json", ("chunk_grid",)),
        (3, "0/zarr.json", ("chunk_grid", "configuration")),
        (3, "0/zarr.json", ("codecs",)),
        (3, "0/zarr.json", ("codecs", 0)),
        (2, ".zattrs", ()),
        (2, ".zattrs", ("multiscales",)),
        (2, "0/.zarray", ()),
        (2, "0/.zarray", ("compressor",)),
        (2, "0/.zarray", ("chunks",)),
        (2, "0/.zarray", ("filters",)),
    ],
)
def test_metadata_of_another_type_are_read_or_refused_with_a_code(tmp_path, version, name, keys, other) -> None:
    store(tmp_path / "a.zarr", version=version)
    file = tmp_path / "a.zarr" / name
    document = within = json.loads(file.read_text())
    for key in keys[:-1]:
        within = within[key]
    if keys:
        within[keys[-1]] = other
    file.write_text(json.dumps(document if keys else other))
    code = ""
    try:
        read(tmp_path / "a.zarr")
    except VolprepError as error:
        code = error.code
    assert code in {"", "VP1220", "VP1221", "VP1224", "VP1225", "VP1260"}


@pytest.mark.long
def test_metadata_nested_as_deep_as_a_worker_can_read_are_refused_or_read(tmp_path) -> None:
    store(tmp_path / "a.zarr")
    for depth in range(700, 1000, 20):
        deep = "[" * depth + "]" * depth
        (tmp_path / "a.zarr/zarr.json").write_text('{"attributes": {"ome": {"version": "0.5", "x": ' + deep + "}}}")
        assert refusal(tmp_path / "a.zarr").code == "VP1220"


def test_several_scales_of_a_level_are_multiplied_and_remarked(tmp_path) -> None:
    told = multiscales("zyx", scale=(2.0, 1.0, 1.0))
    told["datasets"][0]["coordinateTransformations"].append({"type": "scale", "scale": [3.0, 1.0, 1.0]})
    store(tmp_path / "a.zarr", told=told)
    info = read(tmp_path / "a.zarr")[0]
    assert np.isclose(info.grid.spacing_mm_zyx[0], 6e-3, rtol=1e-12)
    assert any("several scales" in remark for remark in info.remarks)
