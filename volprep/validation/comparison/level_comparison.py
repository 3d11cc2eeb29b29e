"""Compare how coarse levels were made: box, the filter, with the level's own table, and truth, side by side."""

import numpy as np

from volprep.truth.picture import encoded
from volprep.validation.bench import Bench
from volprep.validation.comparison.references import References
from volprep.validation.comparison.views import ViewedProgram
from volprep.validation.folder import PICTURES
from volprep.validation.results.measurements import LevelComparison
from volprep.validation.subjects.subject import errors
from volprep.validation.timing.sweep import SWEEP_VIEW
from volprep_formats.arrays import Float64Array
from volprep_formats.package.channel import Level
from volprep_formats.package.program import WITH_TABLES, PictureProgram


def compare_levels(
    bench: Bench, program: PictureProgram, viewed: ViewedProgram, references: References
) -> tuple[LevelComparison, ...]:
    """Compare the coarse levels that are drawn like `program` with box means of the scan, in the view of the sweep.

    The pictures have a quarter of the report's pixels: a voxel of a level still covers more of them than intended.

    Nothing where samples are classified by palettes, or voxels are: there no level has a table of its own. Nor where
    channels are drawn together, which are compared one by one, or a scan with its segments.
    """
    several = any(picture.mixing != "one" for picture in bench.subject.package.manifest.pictures)
    if program.classification not in WITH_TABLES or several:
        return ()
    subject = bench.subject
    wanted = set(subject.levels(program))
    levels = [level for level in subject.package.manifest.levels if level.index in wanted and level.index > 0]
    bench.progress.start(f"levels of {program.transfer}", len(levels))
    if not levels:
        return ()
    small = subject.small
    truth = small.of_its_rays(viewed.truth.rgba)
    return tuple(
        _comparison(
            bench, program, level, truth, small.of_its_rays(references[program.transfer, level.index][SWEEP_VIEW])
        )
        for level in levels
    )


def _comparison(
    bench: Bench, program: PictureProgram, level: Level, truth: Float64Array, box: Float64Array
) -> LevelComparison:
    # Of errors of some hundredths a bound of 1e-4 shows all digits.
    subject, transfer = bench.subject.small.drafted, program.transfer
    with bench.clock.part("oracle"):
        drawn = [subject.on_codes(transfer, SWEEP_VIEW, level.index)]
        if subject.has_own_table(transfer, level.index):
            drawn.append(subject.on_data(transfer, SWEEP_VIEW, level.index))
    shown = [box, *(picture.rgba for picture in drawn), truth]
    name = f"{PICTURES}/{program.name}-level{level.index}.png"
    bench.folder.picture(name, np.concatenate([encoded(rgba, "black") for rgba in shown], axis=1))
    with bench.clock.part("comparing"):
        found = [errors(rgba, truth) for rgba in shown[:-1]]
    bench.progress.advance()
    return LevelComparison(
        level=level.index,
        filter=level.filter,
        box=found[0],
        common=found[1],
        own=found[2] if len(found) > 2 else None,
        picture=name,
    )
