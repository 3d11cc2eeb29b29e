"""What coarse levels gained by how they were made: box, the filter, with the level's own table, truth, side by side."""

import numpy as np

from volprep.kernels import _native
from volprep.truth.decoded import Volume
from volprep.truth.oracle import OraclePicture
from volprep.truth.picture import encoded
from volprep.validation.bench import Bench
from volprep.validation.folder import PICTURES
from volprep.validation.records import LevelComparison
from volprep.validation.same_field import part_of
from volprep.validation.subject import Subject, errors
from volprep_formats.arrays import Float32Array
from volprep_formats.package.channel import Level
from volprep_formats.package.program import Program

_SLAB_VOXELS = 2**22


def compare_levels(bench: Bench, program: Program, view: str) -> tuple[LevelComparison, ...]:
    """Compare the coarse levels that are drawn like `program` with what the box filter would have made of the scan.

    In a quarter of the report's pixels: a voxel of a level still covers more of them than it is meant for.

    Nothing where samples are classified by palettes, or voxels are: there no level has a table of its own. Nor where
    channels are drawn together: each is compared by itself.
    """
    if program.classification not in {"lookup", "preintegrated"} or bench.subject.package.manifest.together is not None:
        return ()
    subject = bench.subject
    wanted = set(subject.levels(program))
    levels = [level for level in subject.package.manifest.levels if level.index in wanted and level.index > 0]
    bench.progress.start(f"levels of {program.transfer}", len(levels))
    if not levels:
        return ()
    with bench.clock.part("oracle"):
        small = subject.small
        truth = small.truth(program.transfer, view)
    return tuple(_comparison(bench, small, program, view, truth, level) for level in levels)


def _comparison(  # noqa: PLR0917 - what is drawn, from where, and what it should be
    bench: Bench, subject: Subject, program: Program, view: str, truth: OraclePicture, level: Level
) -> LevelComparison:
    transfer = program.transfer
    with bench.clock.part("oracle"):
        box = subject.on_volume(_box_level(subject, level), transfer, view)
        common = subject.on_codes(transfer, view, level.index)
        own = subject.on_data(transfer, view, level.index) if subject.has_own_table(transfer, level.index) else None
    shown = [box, common, *([] if own is None else [own]), truth]
    name = f"{PICTURES}/{program.name}-level{level.index}.png"
    bench.folder.picture(name, np.concatenate([encoded(each.rgba, "black") for each in shown], axis=1))
    with bench.clock.part("comparing"):
        found = [errors(each.rgba, truth.rgba) for each in shown]
    bench.progress.advance()
    return LevelComparison(
        level=level.index,
        filter=level.filter,
        box=found[0],
        common=found[1],
        own=None if own is None else found[2],
        picture=name,
    )


def _box_level(subject: Subject, level: Level) -> Volume:
    """Return the means of the scan's values over the cells of a level."""
    scan, grid = subject.scan, subject.package.manifest.grid
    if grid is None:
        msg = "a sealed package without a grid"
        raise ValueError(msg)
    means = box_means(scan, part_of(scan.grid, grid), level.factors_zyx)
    return Volume(means, level.grid, 1.0, 0.0, scan.nearest, scan.normals)


def box_means(scan: Volume, part: tuple[slice, ...], factors_zyx: tuple[int, int, int]) -> Float32Array:
    """Return the means of the physical values of a part of the scan over cells, slab by slab."""
    stored = scan.stored[part]
    means = np.empty(_native.box_reduced_shape(stored.shape, factors_zyx), np.float32)
    rows = stored.shape[1] * stored.shape[2]
    # Whole cells, so that slabs make the same means as the whole.
    cells = max(1, _SLAB_VOXELS // (rows * factors_zyx[0]))
    for first in range(0, len(means), cells):
        slab = stored[first * factors_zyx[0] : (first + cells) * factors_zyx[0]].astype(np.float32)
        slab *= np.float32(scan.slope)
        slab += np.float32(scan.intercept)
        _native.box_reduce(slab, means[first : first + cells], factors_zyx)
    return means
