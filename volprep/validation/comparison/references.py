"""The reference of coarse levels: box means of the scan in NumPy, with the common table, drawn by the oracle in 8 bits.

No level of a package may be worse. A level may be for previews only if the reference is beyond the tolerance, and
beyond the tolerance of such levels only if the reference is, too. None of this depends on data of the package.
"""

from collections.abc import Iterator, Sequence

from volprep.truth.box import box_levels, frequent_level
from volprep.truth.decoded import light_at_level
from volprep.truth.seen import in_8_bits
from volprep.truth.volume import Volume
from volprep.validation.bench import Bench
from volprep.validation.subjects.same_field import part_of
from volprep.validation.subjects.subject import Subject
from volprep_formats.arrays import Float64Array
from volprep_formats.package.channel import Level
from volprep_formats.package.program import PictureProgram

REFERENCE_VIEWS = ("anterior-left", "anterior-right", "posterior-left")
"""The oblique views: rays meet voxels at every angle, and each axis of the scan is seen from aside."""


Reference = dict[str, Float64Array]
"""Box means of one level, drawn with one transfer function by the oracle in the oblique views."""
References = dict[tuple[str, int], Reference]
"""References by transfer function, or picture of several channels, and level."""


def draw_references(bench: Bench, programs: Sequence[PictureProgram]) -> References:
    """Draw the reference of each coarse level that `programs` draw; the scan is read once for all of them.

    The finest level of a package is coarse, too, if the profile cannot hold the whole scan.
    """
    subject = bench.subject
    wanted = {program.transfer: {level for level in subject.levels(program) if level > 0} for program in programs}
    drawn = set[int]().union(*wanted.values())
    levels = [level for level in subject.package.manifest.levels if level.index in drawn]
    bench.progress.start("box reference of levels", len(levels))
    found: References = {}
    for level, volumes in zip(levels, _volumes(subject, levels), strict=True):
        for transfer, indices in wanted.items():
            if level.index in indices:
                with bench.clock.part("oracle"):
                    found[transfer, level.index] = _reference(subject, volumes, transfer)
        bench.progress.advance()
    return found


def reference_view(subject: Subject, level: Level, transfer: str, view: str) -> Float64Array:
    """Draw the reference of a level in another standard view; the scan is read again."""
    (volumes,) = _volumes(subject, [level])
    return _drawn(subject, volumes, transfer, view)


def _reference(subject: Subject, volumes: Sequence[Volume], transfer: str) -> Reference:
    return {name: _drawn(subject, volumes, transfer, name) for name in REFERENCE_VIEWS}


def _drawn(subject: Subject, volumes: Sequence[Volume], transfer: str, view: str) -> Float64Array:
    """Draw into a target of 8 bits, as the level: a level of exact means was worse than its reference by rounding."""
    return in_8_bits(subject.drafted.on_volumes(volumes, transfer, view).rgba)


def _volumes(subject: Subject, levels: Sequence[Level]) -> Iterator[tuple[Volume, ...]]:
    """Return the box means of each level, of every channel that is drawn."""
    parts = [
        _of_channel(part, [part.package.manifest.level(level.index) for level in levels]) for part in subject.channels
    ]
    yield from zip(*parts, strict=True)


def _of_channel(subject: Subject, levels: Sequence[Level]) -> Iterator[Volume]:
    scan, grid = subject.scan, subject.package.manifest.grid
    if grid is None:
        msg = "a sealed package without a grid"
        raise ValueError(msg)
    stored = scan.stored[part_of(scan.grid, grid)]
    if scan.nearest:
        for level in levels:
            labels = frequent_level(stored, level.factors_zyx)
            yield Volume(labels, level.grid, scan.slope, scan.intercept, scan.nearest, scan.normals)
        return
    for level, means in zip(levels, box_levels(stored, [level.factors_zyx for level in levels]), strict=True):
        light = light_at_level(subject.package.manifest, scan.normals, level.factors_zyx)
        yield Volume(means, level.grid, scan.slope, scan.intercept, scan.nearest, light)
