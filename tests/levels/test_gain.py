"""What is reached: coarse levels whose pictures are much nearer to level 0 than the box filter's."""

from pathlib import Path

import numpy as np
import pytest
import tifffile

from tests.support.thin_phantom import GRID, SOLID, VEIL, thin_things
from volprep.parts.levels.choose_level import Chooser
from volprep.parts.levels.level_input import LevelInput, level_slices
from volprep.parts.levels.stage import CANDIDATES
from volprep.scan.slabs import RawVolume
from volprep.transfer.lookup import lookup_table
from volprep.truth.camera import standard_views
from volprep.truth.oracle import oracle_picture
from volprep.truth.volume import Volume
from volprep_formats.grid import Grid
from volprep_formats.package.transfer_function import TransferFunction, TransferPoint

SIZE = 96


def raw(folder: Path, voxels: np.ndarray) -> RawVolume:
    path = folder / "level0.raw"
    voxels.tofile(path)
    return RawVolume(path, voxels.shape, voxels.dtype)


def pictures(voxels: np.ndarray, grid: Grid, function: TransferFunction) -> np.ndarray:
    views = [camera.box_from_clip(grid, 1.0) for camera in standard_views(grid).values()]
    return np.stack([oracle_picture(Volume(voxels, grid), function, view, (SIZE, SIZE), 1e-4).rgba for view in views])


def of_table(table: np.ndarray) -> TransferFunction:
    points = [TransferPoint(value=k, colour=tuple(row[:3]), extinction_per_mm=row[3]) for k, row in enumerate(table)]
    return TransferFunction(name="table", points=tuple(points))


def gains(
    folder: Path, voxels: np.ndarray, grid: Grid, functions: list[TransferFunction], factor: int
) -> dict[str, float]:
    """By what part the error of the pictures falls below the box filter's, for each transfer function."""
    tables = {function.name: lookup_table(function, (0.0, 255.0), 256) for function in functions}
    scan = LevelInput(raw(folder, voxels), grid, tables)
    chooser = Chooser(scan, adapt=True)
    factors = (factor, factor, factor)
    choice, codes = chooser.choose(1, factors, CANDIDATES, folder.joinpath, lambda _: None)
    own = {table.transfer: np.array(table.entries) for table in choice.tables}
    level = codes.read_slab(0, codes.shape_zyx[0])
    box = np.concatenate([each for each, _ in level_slices(scan, "box", factors)])
    found = {}
    for function in functions:
        truth = pictures(voxels, grid, function)
        common, table = (of_table(each[function.name]) for each in (tables, {**tables, **own}))
        plain, ours = (
            np.sqrt(np.mean((pictures(each, grid.coarser(factors), classified) - truth) ** 2))
            for each, classified in ((box, common), (level, table))
        )
        found[function.name] = 1 - ours / plain
    return found


@pytest.mark.long
@pytest.mark.parametrize(("factor", "least"), [(2, 0.45), (4, 0.55)])
def test_thin_things_survive(tmp_path, factor, least) -> None:
    found = gains(tmp_path, thin_things(), GRID, [VEIL, SOLID], factor)
    assert np.mean(list(found.values())) > least, found
    assert min(found.values()) > 0, found


@pytest.mark.long
def test_on_a_real_shell_the_error_is_less_than_half(tmp_path, scans) -> None:
    voxels = tifffile.imread(scans / "qim_microct" / "shell_225x128x128.tif")[9:216]
    found = gains(tmp_path, np.ascontiguousarray(voxels), Grid.of(voxels.shape, (1.0, 1.0, 1.0)), [VEIL, SOLID], 4)
    assert min(found.values()) > 0.5, found
