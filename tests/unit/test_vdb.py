"""OpenVDB: places, values and types of a grid, which grid is taken, and files written and read again."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from command_line import volprep
from header_files import noise, read, refusal_at_open
from vdb_files import TILE, HandGrid, write_vdb_by_hand

from volprep_formats.diagnostics import ExitStatus, VolprepError
from volprep_formats.grid import Grid
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.readers.vdb.tree import list_grids
from volprep_formats.source import SourceInfo, SourceSpec
from volprep_formats.writers.vdb import write

vdb = pytest.importorskip("volprep_formats._vdb", reason="this build has no OpenVDB")

pytestmark = pytest.mark.usefixtures("kept_workers")

TURNED = ((0.0, -2.0, 0.0, 5.0), (1.5, 0.0, 0.0, 6.0), (0.0, 0.0, 3.0, 7.0), (0.0, 0.0, 0.0, 1.0))
TWO_TILES = {(1, 2, 3): 4.0, (2, 2, 3): 7.0}


class ArraySource:
    """A volume in memory."""

    def __init__(self, values: np.ndarray, grid: Grid, slope: float = 1.0, intercept: float = 0.0) -> None:
        self.values = values
        self.info = SourceInfo(format="raw", grid=grid, stored_type=values.dtype.name, slope=slope, intercept=intercept)

    def read_slab(self, z0: int, z1: int) -> np.ndarray:
        return self.values[z0:z1]

    def __enter__(self):
        return self

    def __exit__(self, *exception: object) -> None: ...


def test_tiles_lie_along_x_y_and_z_where_their_indices_say(tmp_path) -> None:
    path = write_vdb_by_hand(tmp_path / "v.vdb", HandGrid(TWO_TILES, world_from_index=TURNED))
    values, info = read(path)
    assert values.shape == (TILE, TILE, 2 * TILE)
    assert (values[:, :, :TILE] == 4.0).all()
    assert (values[:, :, TILE:] == 7.0).all()
    np.testing.assert_allclose(info.grid.world_from_index[:3, :3], np.array(TURNED)[:3, :3])
    np.testing.assert_allclose(info.grid.origin_mm_xyz, (np.array(TURNED) @ [128, 256, 384, 1])[:3])
    assert (info.format, info.stored_type) == ("vdb", "float32")
    (remark,) = info.remarks
    assert "millimetres" in remark


def test_what_is_not_active_has_the_background_and_indices_may_be_negative(tmp_path) -> None:
    grid = HandGrid({(31, 31, 31): 2.0, (31, 30, 30): 3.0}, background=-5.0, corner_xyz=(-4096, -4096, 0))
    values, info = read(write_vdb_by_hand(tmp_path / "v.vdb", grid))
    assert values.shape == (2 * TILE, 2 * TILE, TILE)
    assert [values[z * TILE, y * TILE, 0] for z in (0, 1) for y in (0, 1)] == [3.0, -5.0, -5.0, 2.0]
    assert info.grid.origin_mm_xyz == (-128.0, -256.0, 30 * 128.0)


@pytest.mark.parametrize(("value", "remarks"), [(0.5, 1), (0.1, 2)])
def test_doubles_become_floats_and_a_remark_counts_those_that_change(tmp_path, value, remarks) -> None:
    values, info = read(write_vdb_by_hand(tmp_path / "v.vdb", HandGrid({(0, 0, 0): value}, kind="double")))
    assert values.dtype == np.float32
    assert (values == np.float32(value)).all()
    assert len(info.remarks) == remarks
    assert remarks == 1 or "1 64-bit values" in info.remarks[1]


def test_of_several_grids_the_scene_names_one(tmp_path) -> None:
    grids = (HandGrid({(0, 0, 0): 1.0}), HandGrid({(0, 0, 0): 2.0}, name="heat"))
    path = write_vdb_by_hand(tmp_path / "v.vdb", *grids)
    error = refusal_at_open(path)
    assert error.code == "VP1202"
    assert "'density': float, Fog Volume" in str(error)
    assert "'heat'" in str(error)
    with open_source(SourceSpec(path=str(path), grid="heat"), Path(), Silent()) as source:
        assert (source.read_slab(5, 6) == 2.0).all()
        assert "1 more grids" in source.info.remarks[1]
    with pytest.raises(VolprepError, match="VP1202"):
        open_source(SourceSpec(path=str(path), grid="cold"), Path(), Silent())


def test_the_command_line_names_one_of_several_grids(tmp_path) -> None:
    grids = (HandGrid({(0, 0, 0): 1.0}), HandGrid(TWO_TILES, name="heat"))
    path = write_vdb_by_hand(tmp_path / "v.vdb", *grids)
    done = volprep("import", path, "-o", tmp_path / "a.volpkg", "--vdb-grid", "heat")
    assert done.returncode == 0, done.stderr
    assert "values 4 to 7" in done.stdout


def test_vectors_are_refused(tmp_path) -> None:
    path = write_vdb_by_hand(tmp_path / "v.vdb", HandGrid({(0, 0, 0): 1.0}))
    path.write_bytes(path.read_bytes().replace(b"Tree_float_5_4_3", b"Tree_vec3s_5_4_3"))
    assert refusal_at_open(path).code == "VP1202"
    with pytest.raises(VolprepError, match=r"VP1203.*'density' are of type vec3s"):
        open_source(SourceSpec(path=str(path), grid="density"), Path(), Silent())


def test_a_grid_without_active_voxels_is_refused(tmp_path) -> None:
    assert refusal_at_open(write_vdb_by_hand(tmp_path / "v.vdb", HandGrid({}))).code == "VP1204"


def test_a_box_that_nothing_can_hold_is_refused_before_it_is_allocated(tmp_path) -> None:
    far = HandGrid({(0, 0, 0): 1.0, (31, 31, 31): 1.0})
    error = refusal_at_open(write_vdb_by_hand(tmp_path / "v.vdb", far))
    assert error.code == "VP1205"
    assert "4096×4096×4096" in str(error)


@pytest.mark.parametrize(("entry", "code"), [(0.5, "VP2020"), (1e9, "VP2021")])
def test_a_transform_that_makes_no_grid_is_refused(tmp_path, entry, code) -> None:
    matrix = ((1.0, entry, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), *TURNED[2:])
    path = write_vdb_by_hand(tmp_path / "v.vdb", HandGrid({(0, 0, 0): 1.0}, world_from_index=matrix))
    assert refusal_at_open(path).code == code


def test_the_setting_grid_belongs_to_openvdb_alone(tmp_path) -> None:
    path = tmp_path / "v.mha"
    path.write_text("NDims = 3\n")
    with pytest.raises(VolprepError, match=r"VP1004.*source.grid"):
        open_source(SourceSpec(path=str(path), grid="density"), Path(), Silent())


@pytest.mark.parametrize("shape_zyx", [(3, 1, 4), (9, 17, 8), (1, 1, 1)])
def test_a_volume_that_is_written_reads_the_same(tmp_path, shape_zyx) -> None:
    values = noise("int16", shape_zyx)
    values[0] = 0  # also at the border, where nothing would be active
    grid = Grid.of(shape_zyx, (3.0, 1.5, 2.0), (5.0, 6.0, 7.0), ((0, -1, 0), (1, 0, 0), (0, 0, 1)))
    path = tmp_path / "v.vdb"
    write(ArraySource(values, grid, 0.5, -2.0), path, Silent())
    again, info = read(path)
    assert np.array_equal(again, (0.5 * values - 2.0).astype(np.float32))
    assert info.grid.shape_zyx == shape_zyx
    np.testing.assert_allclose(info.grid.world_from_index, grid.world_from_index, atol=1e-12)


def test_background_is_sparse_and_the_volume_still_whole(tmp_path) -> None:
    values = np.zeros((40, 9, 33), np.float32)
    values[20, 4, 7] = np.float32(0.1)
    path = tmp_path / "v.vdb"
    write(ArraySource(values, Grid.of(values.shape, (1.0, 1.0, 1.0))), path, Silent())
    assert np.array_equal(read(path)[0], values)
    tree = vdb.ScalarGrid(str(path), 0)
    assert (tree.active_voxels, tree.background) == (3, 0.0)
    assert tree.active_box_xyz == ([0, 0, 0], [32, 8, 39])


def test_the_same_volume_gives_the_same_bytes_in_another_process(tmp_path) -> None:
    program = (
        "import sys; from pathlib import Path; from volprep_formats.progress import Silent\n"
        "from volprep_formats.source import *; from volprep_formats.readers import open_source\n"
        "from volprep_formats.writers.vdb import write\n"
        "layout = RawLayout(shape_zyx=(3, 1, 4), dtype='int16')\n"
        "with open_source(SourceSpec(path=sys.argv[1], raw=layout), Path(), Silent()) as source:\n"
        "    write(source, Path(sys.argv[2]), Silent())\n"
    )
    (tmp_path / "v.raw").write_bytes(noise().tobytes())
    for name in ("a.vdb", "b.vdb"):
        subprocess.run([sys.executable, "-c", program, tmp_path / "v.raw", tmp_path / name], check=True)
    assert (tmp_path / "a.vdb").read_bytes() == (tmp_path / "b.vdb").read_bytes()


@pytest.mark.skipif(sys.platform != "linux", reason="counts threads by /proc")
def test_one_thread_does_it_for_a_worker_has_memory_for_no_more(tmp_path) -> None:
    program = (
        "import sys; from pathlib import Path; from volprep_formats import _vdb\n"
        "tasks = Path('/proc/self/task')\n"
        "loaded = len(list(tasks.iterdir()))\n"  # a library of OpenVDB's may start threads of its own
        "_vdb.ScalarGrid(sys.argv[1], 0).active_box_xyz\n"
        "print(len(list(tasks.iterdir())) - loaded)\n"
    )
    path = tmp_path / "v.vdb"
    write(ArraySource(noise("int16", (40, 50, 60)), Grid.of((40, 50, 60), (1.0, 1.0, 1.0))), path, Silent())
    run = subprocess.run([sys.executable, "-c", program, path], check=True, capture_output=True, text=True)
    assert run.stdout == "0\n"


def test_a_place_where_nothing_can_be_written_costs_a_code(tmp_path) -> None:
    with pytest.raises(VolprepError, match="VP1081"):
        write(ArraySource(noise(), Grid.of((3, 1, 4), (1.0, 1.0, 1.0))), tmp_path / "no" / "v.vdb", Silent())


def test_a_build_without_openvdb_says_what_to_do(tmp_path, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "volprep_formats._vdb", None)
    monkeypatch.delattr("volprep_formats._vdb")
    with pytest.raises(VolprepError, match=r"VP1201.*build volprep again") as error:
        list_grids(tmp_path / "v.vdb")
    assert error.value.status == ExitStatus.MACHINE


def test_smoke_is_read_as_its_facts_say(scans) -> None:
    path = scans / "vdb" / "smoke.vdb"
    values, info = read(path)
    assert values.shape == (112, 222, 111)
    tree = vdb.ScalarGrid(str(path), 0)
    assert tree.active_box_xyz == ([1, 2, 1], [111, 223, 112])
    assert tree.active_voxels == 1_049_275  # 38.0 % of the box
    assert np.count_nonzero(values) <= tree.active_voxels
    assert (values.min(), values.max()) == (0.0, np.float16(5.7148438))
    assert np.array_equal(values, values.astype(np.float16)), "the file has half floats"
    assert info.grid.spacing_mm_zyx == pytest.approx((0.47619,) * 3, abs=1e-5)


def test_the_sphere_is_a_level_set_about_the_origin(scans) -> None:
    values, info = read(scans / "vdb" / "sphere.vdb")
    assert values.shape == (125, 125, 125)
    np.testing.assert_allclose(info.grid.origin_mm_xyz, np.full(3, -62 * 0.05), atol=1e-6)
    places = np.arange(-62, 63) * 0.05
    z, y, x = np.meshgrid(places, places, places, indexing="ij")
    distance = np.sqrt(x * x + y * y + z * z) - 3.0
    # Half floats have 11 bits, and the background was rounded to them.
    np.testing.assert_allclose(values, np.clip(distance, -0.15, 0.15), atol=0.15 * 2**-11 + 1e-6)
    assert "level set" in info.remarks[1]
    assert info.level_set


@pytest.mark.parametrize("name", ["smoke.vdb", "sphere.vdb"])
def test_a_real_grid_that_is_written_reads_the_same(scans, tmp_path, name) -> None:
    values, info = read(scans / "vdb" / name)
    path = tmp_path / name
    write(ArraySource(values, info.grid), path, Silent())
    again, about = read(path)
    assert np.array_equal(again, values)
    assert about.grid == info.grid
