"""volprep validate: whether a package may ship, and how wrong its pictures are."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from volprep_cli.console import end_beyond, print_json, print_line, print_table, print_warnings, progress, wants_json
from volprep_cli.outputs import Package
from volprep_cli.studies.ablation import end_with_ablation
from volprep_cli.studies.of_package import Size, Source
from volprep_formats.diagnostics import VolprepError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from volprep.report.study import Study
    from volprep.validation.results.measurements import EmptySpace, ProgramResult, TracedLight
    from volprep.validation.results.report import Report
    from volprep.validation.results.seen import OtherDrawing, SeenNumbers
    from volprep.validation.timing.turns import Milliseconds
    from volprep.validation.witness.records import Witness

ReportFolder = Annotated[
    Path | None,
    typer.Option(
        "--report",
        help="Folder of the report, which replaces an older one; if not given, NAME.report beside the package.",
        metavar="FOLDER",
    ),
]
AskWitness = Annotated[
    bool,
    typer.Option(
        "--witness",
        help="Also let VTK draw the scan and independent libraries read it, and report whether they agree. "
        "Libraries that are not installed are named.",
    ),
]
Devices = Annotated[
    Path | None,
    typer.Option(
        "--devices",
        help="Folder with measurements of this package on devices, as volprep view --devices stores them, for the "
        "report.",
        metavar="FOLDER",
    ),
]
StrictLevels = Annotated[
    bool,
    typer.Option(
        "--strict-levels",
        help="Fail if a coarse level is beyond its tolerance or has lost a thin or small structure, a segment or local "
        "contrast, also if it is for previews only.",
    ),
]
Quick = Annotated[bool, typer.Option("--quick", help="Check only schema, sizes and checksums, without OpenGL.")]

Curves = Annotated[
    bool,
    typer.Option(
        "--curves",
        help="Also measure every choice that trades accuracy for time or bytes: about ninety packages. Takes minutes.",
    ),
]

Ablate = Annotated[
    bool,
    typer.Option(
        "--ablate",
        help="Also measure what each item of the package is worth, by leaving it out or adding it: about fifteen "
        "packages. Takes minutes.",
    ),
]


def validate(
    package: Package,
    *,
    source: Source = None,
    report: ReportFolder = None,
    size: Size = None,
    witness: AskWitness = False,
    devices: Devices = None,
    quick: Quick = False,
    curves: Curves = False,
    ablate: Ablate = False,
    strict_levels: StrictLevels = False,
) -> None:
    """Prove a package: derive its files again from the scan, draw it, compare both with the truth, and write a report.

    Pictures are compared with the integral of the scan in double precision. Exit status 0: every file follows from the
    scan, everything in the package was drawn, and every view is within the tolerance of the scene; with --ablate, each
    item also earns its place, and with --strict-levels no coarse level loses anything. 1: one of these is not so. 5:
    the package is damaged.
    """
    if quick:
        left_out = {"--source": source, "--report": report, "--size": size, "--devices": devices}
        flags = {"--witness": witness, "--curves": curves, "--ablate": ablate, "--strict-levels": strict_levels}
        for option, given in (left_out | flags).items():
            if given not in (None, False):
                raise typer.BadParameter("--quick draws nothing and writes no report: leave it out", param_hint=option)
        _check(package)
        return
    from volprep_formats.installation import require_extra

    require_extra("validate")
    from volprep.report.validate import validate as validate_package
    from volprep.report.verdict_words import unsound_levels
    from volprep.validation.folder import STUDIES, default_report_path
    from volprep.validation.verdicts.errors import error_of_verdict

    folder = report or default_report_path(package)
    studies = _studies(curves=curves, ablate=ablate)
    with progress() as watcher:
        result = validate_package(
            package,
            folder,
            watcher,
            source=source,
            picture_size=size,
            witness=witness,
            devices=devices,
            studies=studies,
        )
    if wants_json():
        print_json(result.model_dump(mode="json"))
    else:
        _print(result, folder)
    print_warnings(result.warnings)
    why_not = error_of_verdict(result, package, folder)
    if why_not is not None:
        end_beyond(why_not)
    unsound = unsound_levels(result.verdict) if strict_levels else ""
    if unsound:
        end_beyond(VolprepError("VP6085", path=package, listed=unsound, report=folder))
    if ablate:
        end_with_ablation(package, folder / STUDIES)


def _studies(*, curves: bool, ablate: bool) -> "list[Study]":
    if not (curves or ablate):
        return []
    from volprep.lab.studies import ABLATION, CURVES

    return [study for study, wanted in ((CURVES, curves), (ABLATION, ablate)) if wanted]


def _check(package: Path) -> None:
    from volprep.pipeline.remarks import warnings
    from volprep.validation.checks.consistency import open_whole
    from volprep_formats.package.check import data_of_others

    whole = open_whole(package)
    told, files = [*warnings(whole.manifest), *data_of_others(whole)], len(whole.manifest.files)
    if wants_json():
        print_json({"package": str(package), "whole": True, "files": files, "warnings": told})
    else:
        print_line(f"{package}: whole, {files} files")
    print_warnings(told)


def _print(report: "Report", folder: Path) -> None:
    from volprep.report.verdict_words import verdict_lines

    for program in report.programs:
        print_line(f"{program.program}, transfer function {program.transfer}, level {program.level}")
        _print_views(program, report.oracle_tolerance)
        print_line("")
        print_line(f"error against run time, view {program.sweep.view}")
        _print_sweep(program)
        if program.others:
            _print_others(program.others)
            _print_styles(program.others)
        if program.empty_space is not None:
            _print_empty_space(program.empty_space)
        if program.light is not None:
            _print_light("baked light", program.light)
        if program.cut_light is not None:
            _print_light("baked light of the cut", program.cut_light)
        print_line("")
    allowed = report.tolerance
    if report.witness is not None:
        _print_witness(report.witness)
    if report.derivation is not None:
        print_line(f"derived again from the scan and compared: {report.derivation.files} files")
    if any(level.preview_only for level in report.verdict.levels):
        loose = allowed.of_previews
        limits = f"RMSE {loose.rmse:g}, FLIP {loose.flip:g}; kept light at least {loose.kept_light:g}"
        print_line(f"allowed for previews, unless box means of the scan are beyond it, too: {limits}")
    limits = f"RMSE {allowed.rmse:g}, largest {allowed.maximum:g}, FLIP {allowed.flip:g}"
    print_line(f"allowed over seen pixels: {limits}; kept light at least {allowed.kept_light:g}")
    print_line(f"drawn by {report.driver.renderer}")
    for line in verdict_lines(report.verdict):
        print_line(line)
    print_line(f"verdict: {report.verdict.code}")
    print_line(f"report: {folder / 'index.html'}")


def _print_views(program: "ProgramResult", bound: float) -> None:
    from volprep.report.text import error, kept_light

    rows = [
        (
            view.view,
            error(view.total.rmse, bound),
            error(view.seen.rmse, bound),
            error(view.seen.maximum, bound),
            f"{view.seen.off:.2%}",
            f"{view.seen.flip:.3f}",
            kept_light(view.seen),
            error(view.data.seen_rmse, max(bound, view.truth_bound)),
            error(view.drawing.seen_rmse, max(bound, view.truth_bound)),
            "within" if view.passed else "beyond",
        )
        for view in program.views
    ]
    heads = (
        "view",
        "RMSE",
        "seen RMSE",
        "largest",
        "off",
        "FLIP",
        "kept light",
        "from data",
        "from drawing",
        "verdict",
    )
    print_table(heads, rows)


def _kept(kept: float | None) -> str:
    return "–" if kept is None else f"{kept:.2f}"


def _print_sweep(program: "ProgramResult") -> None:
    from volprep.report.text import number, ratio

    rows = [
        (
            str(point.level),
            f"{ratio(point.step_ratio)} {number(point.step_mm)} mm",
            number(point.samples_mean),
            _time(point.draw),
            number(point.total.seen_rmse),
            number(point.drawing.seen_rmse),
        )
        for point in program.sweep.points
    ]
    print_table(("level", "step", "samples", "ms (quartiles)", "seen RMSE", "of drawing"), rows)


def _time(draw: "Milliseconds | None") -> str:
    from volprep.report.text import number

    return "–" if draw is None else f"{number(draw.median)} ({number(draw.low, 2)}–{number(draw.high, 2)})"


def _print_others(others: "Sequence[OtherDrawing]") -> None:
    from volprep.report.text import number

    print_line("")
    print_line("coarse levels, one pixel for a voxel, pieces, edits and cuts: the worst view")
    rows = [
        (
            other.item,
            other.program,
            str(other.pixels),
            number(other.rmse),
            number(max(view.seen.maximum for view in other.views)),
            f"{other.flip:.3f}",
            _kept(other.kept_light),
            _worst(other.beside_boxes),
            _worst(other.boxes),
            _judgement(other),
            str(other.right_up_to_pixels or ("none" if other.sizes else "–")),
        )
        for other in others
    ]
    measured = ("seen RMSE", "largest", "FLIP", "kept light", "RMSE / FLIP / kept beside box", "box")
    print_table(("drawn", "program", "pixels", *measured, "verdict", "right up to"), rows)


def _print_styles(others: "Sequence[OtherDrawing]") -> None:
    """Print how much light segments keep at coarse levels."""
    rows = [
        (
            other.item,
            other.program,
            style.transfer,
            f"{style.kept_light:.2f}",
            f"{style.least} {_kept(style.least_kept_light)}" if style.least else "–",
            f"{len(style.lost) + len(style.too_small)} of {style.segments}",
            ", ".join((*style.lost, *style.lost_parts)) or "–",
            ", ".join(style.too_small) or "–",
        )
        for other in others
        for style in other.styles
    ]
    if rows:
        print_line("")
        print_line("light of segments, each alone, over that of the scan")
        print_table(
            ("drawn", "program", "style", "kept light", "least", "gone", "lost", "smaller than half a voxel"), rows
        )


def _judgement(other: "OtherDrawing") -> str:
    words = ["within" if other.passed else "beyond"]
    if other.loses_segments:
        words.append("loses segments")
    elif other.excused and not other.passed:
        words.append("as box means")
    if other.preview_only:
        words.append("for previews")
    return ", ".join(words)


def _worst(views: "Sequence[SeenNumbers]") -> str:
    """Return the worst of the numbers of some views: those in which the box reference was drawn."""
    from volprep.validation.results.seen import least_light

    if not views:
        return "–"
    kept = _kept(least_light(view.kept_light for view in views))
    return f"{max(compared.rmse for compared in views):.3g} / {max(compared.flip for compared in views):.3g} / {kept}"


def _print_witness(witness: "Witness") -> None:
    from volprep.report.text import number

    print_line(f"second witness: {witness.renderer or 'none'}")
    rows = [
        (
            program.program,
            view.view,
            number(view.truth_rmse),
            number(view.drawn_rmse),
            number(view.bound),
            "agrees" if view.passed else "disagrees",
        )
        for program in witness.programs
        for view in program.views
    ]
    if rows:
        print_table(("program", "view", "from truth", "from package", "its own error", "VTK"), rows)
    checks = []
    for check in witness.checks:
        verdict = "agrees" if check.passed else "disagrees"
        checks.append((check.item, check.by, check.what, number(check.found), number(check.limit), verdict))
    if checks:
        print_table(("second reading", "by", "what", "found", "limit", "verdict"), checks)
    print_line("")


def _print_empty_space(found: "EmptySpace") -> None:
    from volprep.report.text import number

    plain = found.ways[0]
    rows = [
        (
            way.way,
            "–" if way.samples_mean is None else number(way.samples_mean),
            _time(way.draw),
            f"{plain.draw.median / way.draw.median:.2f} ×",
            number(way.difference),
        )
        for way in found.ways
    ]
    print_line("")
    print_line("empty space, as the package draws last")
    print_table(("left out by", "samples", "ms (quartiles)", "faster", "largest difference"), rows)


def _print_light(name: str, found: "TracedLight") -> None:
    from volprep.report.text import number

    noise = f"noise of its {found.paths} paths, {number(found.noise_rmse)}, left out"
    print_line("")
    around = ", the light around as it is and turned" if found.orientations > 1 else ""
    print_line(f"{name} against path tracing: RMSE {number(found.rmse)} over {found.pixels} pixels{around}, {noise}")
