"""volprep study stress: cases in which arithmetic is hard, drawn on this machine and judged."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from volprep_cli.console import end_beyond, print_json, print_line, print_table, progress, wants_json
from volprep_formats.diagnostics import VolprepError

if TYPE_CHECKING:
    from volprep.lab.stress.records import StressDrawing, StressReport

Profile = Annotated[str, typer.Option(help="Class of devices with shaders: a name, or a TOML file.", metavar="PROFILE")]
Cases = Annotated[
    list[str], typer.Option("--case", help="Run only this case. Can be given several times.", metavar="NAME")
]
Techniques = Annotated[
    list[str],
    typer.Option("--technique", help="Draw only with this technique. Can be given several times.", metavar="NAME"),
]
Precisions = Annotated[
    list[str],
    typer.Option(
        "--precision",
        help="Draw only with this precision: highp, as in packages; mediump, rounded to 16 bits after each "
        "operation; mediump-coordinates, only texture coordinates rounded. Can be given several times.",
        metavar="NAME",
    ),
]
Levels = Annotated[bool, typer.Option("--levels/--no-levels", help="Also draw two coarser levels.")]
Seconds = Annotated[
    float | None,
    typer.Option("--seconds", help="Start no case after this number of seconds.", min=0.0, metavar="NUMBER"),
]
ReportFolder = Annotated[
    Path, typer.Option("--report", help="Folder of the report; an older report is replaced.", metavar="FOLDER")
]


def stress(
    *,
    profile: Profile = "gles3",
    case: Cases = [],  # noqa: B006 - typer asks for a list, and nothing changes it
    technique: Techniques = [],  # noqa: B006
    precision: Precisions = [],  # noqa: B006
    levels: Levels = True,
    seconds: Seconds = None,
    report: ReportFolder = Path("stress.report"),
) -> None:
    """Draw numerically hard cases on this driver: dense media, thin features, extreme values.

    Each case is a small scan. volprep builds it, draws it with lookup tables and with pre-integrated tables, with every
    technique, on coarser levels and in 16-bit floats, and compares the pictures with the truth.

    Exit status 0: every case is drawn or refused as expected. 1: a case is not, or was not tried.
    """
    from volprep_formats.installation import require_extra

    require_extra("validate")
    from volprep.lab.stress.cases import CASES
    from volprep.lab.stress.drawing import PRECISIONS, Trials
    from volprep.lab.stress.study import stress as try_cases
    from volprep.scene.profiles import load_profile
    from volprep.techniques import TECHNIQUES

    names = [case.name for case in CASES]
    _require_known("--case", case, names)
    _require_known("--technique", technique, TECHNIQUES)
    _require_known("--precision", precision, PRECISIONS)
    chosen = [known for known in CASES if not case or known.name in case]
    trials = Trials(
        techniques=tuple(value for value in TECHNIQUES if not technique or value in technique),
        precisions=tuple(known for known in PRECISIONS if not precision or known in precision),
        levels=levels,
        seconds=seconds,
    )
    with progress() as watcher:
        result = try_cases(chosen, load_profile(profile, Path()), report, watcher, trials)
    if wants_json():
        print_json(result.model_dump(mode="json"))
    else:
        _print(result, report)
    if not result.passed:
        end_beyond(_why_not(result, report))


def _require_known(option: str, given: Iterable[str], known: Iterable[str]) -> None:
    if unknown := set(given).difference(known):
        msg = f"{option} is {min(unknown)}, but must be one of {', '.join(known)}"
        raise typer.BadParameter(msg)


def _print(report: "StressReport", folder: Path) -> None:
    rows = []
    for result in report.results:
        if result.refused:
            verdict = "as it must be" if result.passed else "not to be refused"
            rows.append((result.case, f"refused, {result.refused}", "", "", verdict))
        shown = [drawing for drawing in result.drawings if drawing.is_first or not drawing.passed]
        rows += [(result.case, *_cells(drawing, report.oracle_tolerance)) for drawing in shown]
        if more := sum(not drawing.is_first and drawing.passed for drawing in result.drawings):
            rows.append((result.case, f"{more} other ways", "", "in the report", "within or reported"))
    print_table(("case", "drawn by", "seen RMSE / largest", "seen RMSE by step", "verdict"), rows)
    if report.left_out:
        print_line(f"not tried, because the time was over: {', '.join(report.left_out)}")
    print_line(f"not judged: {len(report.not_judged)} kinds of pictures, which the report lists")
    print_line(f"report: {folder / 'index.html'}")


def _cells(drawing: "StressDrawing", bound: float) -> tuple[str, str, str, str]:
    from volprep.report.text import error, number, ratio

    steps = ", ".join(
        f"{ratio(point.step_ratio)}: {error(point.rmse, bound)} in {number(point.draw_ms, 2)} ms"
        for point in drawing.points
    )
    total = f"{error(drawing.total.seen_rmse, bound)} / {error(drawing.total.maximum, bound)}"
    unjudged = drawing.limit is None and not drawing.laws
    verdict = "reported" if unjudged else "within" if drawing.passed else "; ".join(drawing.problems) or "beyond"
    return drawing.name, total, steps, verdict


def _why_not(report: "StressReport", folder: Path) -> VolprepError:
    failed = [result for result in report.results if not result.passed]
    if not failed:
        tried = len(report.results)
        listed = ", ".join(report.left_out)
        return VolprepError("VP6072", count=len(report.left_out), cases=tried + len(report.left_out), listed=listed)
    first = failed[0]
    problem = f"refused with {first.refused}" if first.refused else "it is drawn, and must be refused"
    for drawing in reversed(first.drawings):
        if not drawing.passed:
            judged = drawing.precise or drawing.total
            numbers = f"RMSE over seen pixels {judged.seen_rmse:.4g}, largest error {judged.maximum:.4g}"
            problem = "; ".join((f"{drawing.name}: {numbers}", *drawing.problems))
    return VolprepError(
        "VP6018",
        failed=len(failed),
        cases=len(report.results),
        case=first.case,
        problem=problem,
        report=folder / "index.html",
    )
