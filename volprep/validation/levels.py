"""Compare how coarse levels were made: box, the filter, with the level's own table, and truth, side by side."""

import numpy as np

from volprep.truth.oracle import OraclePicture
from volprep.truth.picture import encoded
from volprep.validation.bench import Bench
from volprep.validation.folder import PICTURES
from volprep.validation.records import LevelComparison
from volprep.validation.references import References
from volprep.validation.subject import Subject, errors
from volprep_formats.package.channel import Level
from volprep_formats.package.program import Program


def compare_levels(bench: Bench, program: Program, view: str, references: References) -> tuple[LevelComparison, ...]:
    """Compare the coarse levels that are drawn like `program` with box means of the scan.

    The pictures have a quarter of the report's pixels: a voxel of a level still covers more of them than intended.

    Nothing where samples are classified by palettes, or voxels are: there no level has a table of its own. Nor where
    channels are drawn together, which are compared one by one, or a scan with its segments.
    """
    manifest = bench.subject.package.manifest
    several = manifest.together is not None or manifest.segments is not None
    if program.classification not in {"lookup", "preintegrated"} or several:
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
    return tuple(
        _comparison(bench, small, program, view, truth, level, references[program.transfer, level.index].small)
        for level in levels
    )


def _comparison(  # noqa: PLR0917 - the drawn data, its place, and the truth
    bench: Bench,
    subject: Subject,
    program: Program,
    view: str,
    truth: OraclePicture,
    level: Level,
    box: OraclePicture,
) -> LevelComparison:
    transfer = program.transfer
    with bench.clock.part("oracle"):
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
