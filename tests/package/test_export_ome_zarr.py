"""volprep export PACKAGE scan.ome.zarr, read back by volprep, zarr, ome-zarr, its models of the format and zarrita."""

import errno
import json
import math
import tracemalloc

import numpy as np
import pytest
import zarr
from channel_scene import write_channel_scene
from command_line import ended, volprep
from every_kind import write_segments
from format_samples import SAMPLES
from npm_package import npm_package
from scene_builds import built
from tiny_packages import ES2, ES3, function, lossless, tiny_package

from volprep.parts.mosaic.packing import Packing
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.package.parts.segments.texels import held_labels
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.readers.volpkg import open_level, open_levels
from volprep_formats.source import SourceInfo, SourceSpec
from volprep_formats.writers import ome_zarr
from volprep_formats.writers.ngff import ChannelLook

STRAIGHT = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
TURNED = ((0.0, 0.6, -0.8), (1.0, 0.0, 0.0), (0.0, -0.8, -0.6))
CODES = np.random.default_rng(7).integers(0, 256, (37, 5, 71)).astype(np.uint8)
LEVELS = [CODES, CODES[::2, ::2, ::2]]
RAMP = function((-90.0, (1.0, 0.5, 0.0), 0.0), (-50.0, (1.0, 0.5, 0.0), 0.2), (20.0, (1.0, 0.5, 0.0), 0.0))
QUANTIZED = lossless(0.5, -100.0)


def grid(direction=STRAIGHT):
    return Grid.of(CODES.shape, (2.5, 0.7, 0.3), (-101.123456789, 33.3, 7.1), direction)


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    folder = tmp_path_factory.mktemp("straight") / "tiny.volpkg"
    tiny_package(folder, LEVELS, RAMP, ES3, grid=grid(), quantization=QUANTIZED)
    return folder


@pytest.fixture(scope="module")
def store(package):
    done = volprep("export", package, package.parent / "a.ome.zarr", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["shapes_zyx"] == [[37, 5, 71], [19, 3, 36]]
    assert "direction" not in done.stderr
    return package.parent / "a.ome.zarr"


def export(package, path, **options):
    opened = open_levels(package)
    looks = [ChannelLook.of(manifest) for manifest in opened.manifests]
    return ome_zarr.write(opened.levels, looks, path, Silent(), **options)


def tree(folder):
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("level", [0, 1])
def test_our_reader_finds_the_same_values_at_the_same_places(store, level) -> None:
    with open_source(SourceSpec(path=str(store), level=level), store.parent, Silent()) as source:
        expected = grid() if level == 0 else grid().coarser((2, 2, 2))
        assert source.info.grid.shape_zyx == expected.shape_zyx
        np.testing.assert_allclose(source.info.grid.world_from_index, expected.world_from_index, rtol=0, atol=1e-9)
        found = source.read_slab(0, expected.shape_zyx[0])
    np.testing.assert_array_equal(found, LEVELS[level] * np.float32(0.5) - 100)


def test_zarr_finds_sharded_arrays_without_missing_chunks(store) -> None:
    group = zarr.open_group(store, mode="r")
    for number, codes in enumerate(LEVELS):
        array = group[str(number)]
        np.testing.assert_array_equal(array[...], codes * np.float32(0.5) - 100)
        assert array.metadata.dimension_names == ("z", "y", "x")
        assert [codec.to_dict()["name"] for codec in array.metadata.codecs] == ["sharding_indexed"]
        files = [path for path in (store / str(number) / "c").rglob("*") if path.is_file()]
        assert len(files) == math.prod(-(-n // m) for n, m in zip(array.shape, array.shards, strict=True))


def test_the_window_is_where_the_function_is_visible_and_the_colour_is_its_own(store, package) -> None:
    omero = zarr.open_group(store, mode="r").attrs["ome"]["omero"]
    channel = omero["channels"][0]
    assert channel["window"] == {"start": -90.0, "end": 20.0, "min": -100.0, "max": 27.5}
    assert channel["color"] == "FFBC00"  # sRGB of linear 0.5 is 187.5
    export(package, package.parent / "codes.ome.zarr", stored=True)
    stored = zarr.open_group(package.parent / "codes.ome.zarr", mode="r")
    np.testing.assert_array_equal(stored["0"][...], CODES)
    window = stored.attrs["ome"]["omero"]["channels"][0]["window"]
    assert window == {"start": 20.0, "end": 240.0, "min": 0.0, "max": 255.0}


def test_the_models_of_the_format_accept_the_store(store) -> None:
    models = pytest.importorskip("ome_zarr_models.v05.image", reason="ome-zarr-models is not installed")
    image = models.Image.from_zarr(zarr.open_group(store, mode="r"))
    assert [dataset.path for dataset in image.attributes.ome.multiscales[0].datasets] == ["0", "1"]


def test_the_library_ome_zarr_finds_levels_scales_and_windows(store) -> None:
    io = pytest.importorskip("ome_zarr.io", reason="ome-zarr is not installed")
    reader = pytest.importorskip("ome_zarr.reader", reason="ome-zarr is not installed")
    (node,) = list(reader.Reader(io.parse_url(str(store)))())
    for codes, data in zip(LEVELS, node.data, strict=True):
        np.testing.assert_array_equal(np.asarray(data), codes * np.float32(0.5) - 100)
    assert node.metadata["contrast_limits"] == [[-90.0, 20.0]]
    (scale, _), _ = node.metadata["coordinateTransformations"]
    assert scale["scale"] == [2.5, 0.7, 0.3]
    assert {axis["unit"] for axis in node.metadata["axes"]} == {"millimeter"}


def test_zarrita_reads_the_same_values(store) -> None:
    folder = npm_package("zarrita", "0.7.5")
    script = folder / "read_ome_zarr.mjs"
    script.write_text(
        """import * as zarr from "zarrita";
import { FileSystemStore } from "@zarrita/storage";
const root = await zarr.open.v3(zarr.root(new FileSystemStore(process.argv[2])), { kind: "group" });
for (const { path } of root.attrs.ome.multiscales[0].datasets) {
  const { data, shape } = await zarr.get(await zarr.open.v3(root.resolve(path), { kind: "array" }));
  let sum = 0;
  data.forEach((value, index) => { sum += value * (1 + index % 97); });
  console.log(JSON.stringify([shape, sum]));
}
"""
    )
    done = ended(["node", script, store], timeout=60)
    assert done.returncode == 0, done.stderr
    for line, codes in zip(done.stdout.splitlines(), LEVELS, strict=True):
        physical = codes.ravel() * 0.5 - 100
        assert json.loads(line) == [list(codes.shape), float((physical * (1 + np.arange(codes.size) % 97)).sum())]


@pytest.mark.long
def test_of_a_turned_volume_positions_are_along_its_axes_and_the_direction_is_told(tmp_path) -> None:
    tiny_package(tmp_path / "a.volpkg", CODES, RAMP, ES2, grid=grid(TURNED), packing=Packing(4))
    done = volprep("export", tmp_path / "a.volpkg", tmp_path / "a.ome.zarr")
    assert done.returncode == 0, done.stderr
    assert "OME-NGFF 0.5 has no directions" in done.stderr
    attributes = dict(zarr.open_group(tmp_path / "a.ome.zarr", mode="r").attrs)
    (dataset,) = attributes["ome"]["multiscales"][0]["datasets"]
    _, translation = dataset["coordinateTransformations"]
    world = np.array(attributes["volprep"]["direction"]) @ translation["translation"][::-1]
    np.testing.assert_allclose(world, grid().origin_mm_xyz, rtol=0, atol=1e-9)


def test_the_same_package_gives_the_same_bytes(package, store, tmp_path) -> None:
    assert volprep("export", package, tmp_path / "b.ome.zarr").returncode == 0
    assert tree(tmp_path / "b.ome.zarr") == tree(store)


def test_one_level_alone_is_written_when_it_is_named(package, tmp_path) -> None:
    assert volprep("export", package, tmp_path / "a.ome.zarr", "--level", "1").returncode == 0
    assert [*zarr.open_group(tmp_path / "a.ome.zarr", mode="r").array_keys()] == ["1"]
    assert "VP1250" in volprep("export", package, tmp_path / "b.ome.zarr", "--level", "2").stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.ome.zarr"]


@pytest.mark.parametrize("exchanges", [True, False])
def test_force_replaces_an_exported_store_and_nothing_else(package, tmp_path, monkeypatch, exchanges) -> None:
    if not exchanges:
        monkeypatch.setattr("volprep_formats.output._renameat2", lambda *_: False)
    path = tmp_path / "a.ome.zarr"
    export(package, path)
    expected = tree(path)
    (path / "0" / "older").touch()
    with pytest.raises(VolprepError, match="VP1254"):
        export(package, path)
    export(package, path, replaces=True)
    assert tree(path) == expected
    (path / "mine.txt").write_text("mine")
    with pytest.raises(VolprepError, match="VP1254"):
        export(package, path, replaces=True)
    (path / "mine.txt").unlink()
    zarr.open_group(path, mode="a").attrs.put({"ome": {}})
    with pytest.raises(VolprepError, match="VP1254"):
        export(package, path, replaces=True)
    assert [each.name for each in tmp_path.iterdir()] == ["a.ome.zarr"]


class Deep:
    """A volume of many slices, made when they are read."""

    info = SourceInfo(format="test", grid=Grid.of((1024, 128, 256), (1.0, 1.0, 1.0)), stored_type="uint8")

    def read_slab(self, z0, z1):
        return np.full((z1 - z0, 128, 256), z0 % 251, np.uint8)


def test_memory_does_not_grow_with_slices_and_a_failure_leaves_nothing(tmp_path) -> None:
    look = ChannelLook(channel="scan", level_filter="none", range=(0.0, 255.0), window=None)
    tracemalloc.start()
    ome_zarr.write([(0, [Deep()])], [look], tmp_path / "a.ome.zarr", Silent())
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1024 * 128 * 256 / 4

    class Full(Deep):
        def read_slab(self, z0, z1):
            raise OSError(errno.ENOSPC, "No space left on device")

    with pytest.raises(VolprepError, match="VP1081"):
        ome_zarr.write([(0, [Full()])], [look], tmp_path / "b.ome.zarr", Silent())
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.ome.zarr"]


@pytest.fixture(scope="module")
def tissues(tmp_path_factory):
    """A package of two channels, and its store."""
    folder = tmp_path_factory.mktemp("tissues")
    built(write_channel_scene(folder), folder / "p.volpkg")
    done = volprep("export", folder / "p.volpkg", folder / "a.ome.zarr", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["channels"] == ["skin", "bone"]
    return folder / "p.volpkg", folder / "a.ome.zarr"


def test_several_channels_are_an_axis_with_their_windows_and_colours(tissues) -> None:
    package, store = tissues
    group = zarr.open_group(store, mode="r")
    ome = group.attrs["ome"]
    assert [axis["name"] for axis in ome["multiscales"][0]["axes"]] == ["c", "z", "y", "x"]
    channels = Package.open(package).manifest.channels
    for index, channel in enumerate(channels):
        for level in channel.levels:
            with open_level(package, level.index, channel.name) as source:
                slab = source.read_slab(0, level.grid.shape_zyx[0])
                physical = slab.astype(np.float64) * source.info.slope + source.info.intercept
            np.testing.assert_array_equal(group[str(level.index)][index], physical.astype(np.float32))
        written = ome["omero"]["channels"][index]
        points = channel.transfer_functions[0].points
        assert (written["label"], written["active"]) == (channel.name, True)
        assert points[0].value <= written["window"]["start"] < written["window"]["end"] <= points[-1].value
    assert len({channel["color"] for channel in ome["omero"]["channels"]}) == len(channels)
    one = volprep("export", package, store.with_name("b.ome.zarr"), "--channel", "skin")
    assert one.returncode == 0, one.stderr
    assert zarr.open_group(store.with_name("b.ome.zarr"), mode="r")["0"].ndim == 3


def test_the_library_ome_zarr_finds_both_channels(tissues) -> None:
    io = pytest.importorskip("ome_zarr.io", reason="ome-zarr is not installed")
    reader = pytest.importorskip("ome_zarr.reader", reason="ome-zarr is not installed")
    (node,) = list(reader.Reader(io.parse_url(str(tissues[1])))())
    assert node.metadata["channel_names"] == ["skin", "bone"]
    assert len(node.metadata["contrast_limits"]) == 2
    assert node.data[0].shape[0] == 2


@pytest.fixture(scope="module")
def segmented(tmp_path_factory):
    """A package of a scan with two segments that overlap, and its store."""
    folder = tmp_path_factory.mktemp("segmented")
    made = folder / "p.volpkg"
    built(write_segments(folder), made)
    done = volprep("export", made, folder / "a.ome.zarr", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["labels"] == ["segments"]
    return made, folder / "a.ome.zarr"


def test_segments_are_labels_with_names_and_colours(segmented) -> None:
    made, store = segmented
    manifest = Package.open(made).manifest
    assert zarr.open_group(store / "labels", mode="r").attrs["ome"]["labels"] == ["segments"]
    group = zarr.open_group(store / "labels" / "segments", mode="r")
    label = group.attrs["ome"]["image-label"]
    assert label["source"] == {"image": "../../"}
    names = {each["label-value"]: each["name"] for each in label["properties"]}
    assert {each["label-value"] for each in label["colors"]} == set(names)
    assert set(names) <= set(range(1, 4))
    for number in [level.index for level in manifest.levels]:
        codes = held_labels(manifest.textures, number, Package.open(made).read_bytes)
        written = group[str(number)][...]
        assert written.shape == zarr.open_group(store, mode="r")[str(number)].shape
        assert np.issubdtype(written.dtype, np.integer)
        for code, entry in enumerate(manifest.segments.labels):
            found = {int(value) for value in np.unique(written[codes == code])}
            titles = {each.name: each.title or each.name for each in manifest.segments.segments}
            named = " + ".join(titles[name] for name in entry.segments)
            assert {names.get(value, "") for value in found} <= {named}
            assert (0 in found) <= (not entry.segments)


def test_the_library_ome_zarr_finds_the_labels(segmented) -> None:
    io = pytest.importorskip("ome_zarr.io", reason="ome-zarr is not installed")
    reader = pytest.importorskip("ome_zarr.reader", reason="ome-zarr is not installed")
    nodes = list(reader.Reader(io.parse_url(str(segmented[1])))())
    (labels,) = [node for node in nodes if node.zarr.basename() == "segments"]
    assert np.asarray(labels.data[0]).max() >= 1
    assert len(labels.metadata["color"]) > 1


def test_a_label_map_is_written_as_labels_too(tmp_path) -> None:
    codes = np.random.default_rng(3).integers(0, 3, (6, 7, 8)).astype(np.uint8)
    colours = function((0.0, (0.0, 0.0, 0.0), 0.0), (1.0, (1.0, 0.0, 0.0), 0.5), (2.0, (0.0, 0.18, 0.0044), 0.5))
    tiny_package(tmp_path / "a.volpkg", codes, colours, ES3, labels=True)
    done = volprep("export", tmp_path / "a.volpkg", tmp_path / "a.ome.zarr")
    assert done.returncode == 0, done.stderr
    group = zarr.open_group(tmp_path / "a.ome.zarr" / "labels" / "scan", mode="r")
    np.testing.assert_array_equal(group["0"][...], codes)
    colors = group.attrs["ome"]["image-label"]["colors"]
    assert colors == [{"label-value": 1, "rgba": [255, 0, 0, 255]}, {"label-value": 2, "rgba": [0, 118, 14, 255]}]


def test_labels_whose_colours_begin_between_codes_are_written(tmp_path) -> None:
    codes = np.random.default_rng(3).integers(0, 3, (6, 7, 8)).astype(np.uint8)
    colours = function(
        (0.5, (1.0, 0.0, 0.0), 0.0),
        (0.5, (1.0, 0.0, 0.0), 0.5),
        (1.5, (1.0, 0.0, 0.0), 0.5),
        (1.5, (0.0, 0.0, 1.0), 0.5),
    )
    tiny_package(tmp_path / "a.volpkg", codes, colours, ES3, labels=True)
    done = volprep("export", tmp_path / "a.volpkg", tmp_path / "a.ome.zarr")
    assert done.returncode == 0, done.stderr
    group = zarr.open_group(tmp_path / "a.ome.zarr" / "labels" / "scan", mode="r")
    colors = group.attrs["ome"]["image-label"]["colors"]
    assert colors == [{"label-value": 1, "rgba": [255, 0, 0, 255]}, {"label-value": 2, "rgba": [0, 0, 255, 255]}]


def test_the_models_of_the_format_accept_channels_and_labels(tissues, segmented) -> None:
    image = pytest.importorskip("ome_zarr_models.v05.image", reason="ome-zarr-models is not installed")
    label = pytest.importorskip("ome_zarr_models.v05.image_label", reason="ome-zarr-models is not installed")
    for _, store in (tissues, segmented):
        image.Image.from_zarr(zarr.open_group(store, mode="r"))
    label.ImageLabel.from_zarr(zarr.open_group(segmented[1] / "labels" / "segments", mode="r"))


@pytest.mark.parametrize(("name", "more"), [("store.ome.zarr", ()), ("voxels.glb", ("--volume",))])
def test_channels_on_several_grids_are_written_one_by_one(tmp_path, name, more) -> None:
    package = str(SAMPLES["two-grids"].package)
    refused = volprep("export", package, tmp_path / name, *more)
    assert refused.returncode != 0
    assert "VP1248" in refused.stderr
    assert list(tmp_path.iterdir()) == []
    told = volprep("export", package, tmp_path / name, *more, "--channel", "activity")
    assert told.returncode == 0
    assert "7×9×8" in told.stdout or "8×9×7" in told.stdout
