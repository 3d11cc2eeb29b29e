"""Later frames of a time series: the finest level of each, drawn from three sides and compared with its own scan."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from volprep.render.renderers import renderer_of
from volprep.truth.volume import Volume
from volprep.validation.bench import Bench
from volprep.validation.comparison.edits_and_cuts import OBLIQUE
from volprep.validation.comparison.pixels import judged
from volprep.validation.comparison.seen import width_pixels
from volprep.validation.results.measurements import ProgramResult
from volprep.validation.results.seen import OtherDrawing
from volprep.validation.subjects.subject import Subject
from volprep_formats.package.channel_packages import channel_packages
from volprep_formats.package.reader import Package


def with_later_frames(
    programs: Sequence[ProgramResult], package: Package, scans: Sequence[Mapping[str, Volume]], bench: Bench
) -> tuple[ProgramResult, ...]:
    """Return the results with the later frames, whose `scans` are given; `bench` is that of the first one."""
    bench.progress.start("later frames", len(scans))
    found: list[tuple[str, OtherDrawing]] = []
    for number, scan in enumerate(scans, 1):
        for name, part in channel_packages(package.at_frame(number)).items():
            found += _judged(bench, Subject(part, scan[name], bench.subject.shape_hw[0]), number)
        bench.progress.advance()
    return tuple(
        result.model_copy(
            update={"others": (*result.others, *(other for name, other in found if name == result.transfer))}
        )
        for result in programs
    )


def _judged(bench: Bench, subject: Subject, number: int) -> Iterator[tuple[str, OtherDrawing]]:
    for program in subject.programs:
        level = subject.package.manifest.level(min(program.levels))
        width = width_pixels(subject.cameras.values(), level.grid, subject.shape_hw[0])
        renderer = renderer_of(subject.package, level=level.index, transfer=program.transfer)
        with renderer, bench.clock.part("drawing"):
            drawn = {view: renderer.render(subject.views[view], subject.shape_hw) for view in OBLIQUE}
        with bench.clock.part("oracle"):
            truths = {view: subject.drafted.truth(program.transfer, view).rgba.astype(np.float32) for view in OBLIQUE}
        yield (
            program.transfer,
            OtherDrawing(
                item=f"frame {number} with {program.transfer}",
                program=program.name,
                pixels=subject.shape_hw[0],
                views=tuple(
                    judged(view, drawn[view], truths[view], subject.render.tolerance, width) for view in OBLIQUE
                ),
            ),
        )
