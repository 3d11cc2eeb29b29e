"""Truth pictures of a validation, written beside the report, to compare devices with."""

from collections.abc import Iterable

from volprep.validation.bench import Bench
from volprep.validation.comparison.views import ViewedProgram
from volprep.validation.results.measurements import ProgramResult
from volprep.validation.results.truth import TRUTH_FILE, TruthIndex, TruthPoint, TruthProgram, TruthView
from volprep_formats.light_pictures import light_bytes
from volprep_formats.package.digest import manifest_sha256


def write_truth(first: Bench, measured: Iterable[tuple[Bench, ViewedProgram, ProgramResult]]) -> None:
    """Write the truth of all standard views of each program, and the list of drawings for a device."""
    subject = first.subject
    index = TruthIndex(
        manifest_sha256=manifest_sha256(subject.package.path),
        picture_size=subject.shape_hw[0],
        step_mm=subject.step_mm,
        programs=tuple(_program(number, *value) for number, value in enumerate(measured)),
    )
    first.folder.truth(TRUTH_FILE, (index.model_dump_json(indent=2) + "\n").encode())


def _program(number: int, bench: Bench, viewed: ViewedProgram, result: ProgramResult) -> TruthProgram:
    views = []
    for name, truth in viewed.truths.items():
        # By number: names of programs are the package's own words until it is proved.
        file = f"{number}-{name}.light"
        bench.folder.truth(file, light_bytes(truth))
        matrix = bench.subject.views[name].reshape(-1).tolist()
        views.append(TruthView(view=name, box_from_clip=tuple(matrix), file=file))
    return TruthProgram(
        program=result.program,
        transfer=result.transfer,
        level=result.level,
        views=tuple(views),
        sweep_view=result.sweep.view,
        points=tuple(TruthPoint(level=point.level, step_mm=point.step_mm) for point in result.sweep.points),
    )
