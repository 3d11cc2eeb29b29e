"""volprep validate: whether a package may ship, and how wrong its pictures are."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from volprep_cli.console import Json, bytes_text, end_beyond, print_json, print_line, print_table, progress
from volprep_formats.diagnostics import VolprepError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from volprep.validation.ablation.records import Ablation, Measurement
    from volprep.validation.records import EmptySpace, OtherDrawing, ProgramResult, Report, Verdict
    from volprep.validation.witness.records import Witness

Package = Annotated[Path, typer.Argument(help="Package.", metavar="PACKAGE")]
Source = Annotated[
    Path | None,
    typer.Option(
        help="The scan, or the scene, that the package was made from; if not given, PACKAGE.origin.json names it.",
        metavar="PATH",
    ),
]
ReportFolder = Annotated[
    Path | None,
    typer.Option(
        "--report", help="Folder of the report; if not given, NAME.report beside the package.", metavar="FOLDER"
    ),
]
Size = Annotated[
    int | None,
    typer.Option(
        min=16, max=4096, help="Width and height of the pictures; if not given, those of the scene.", metavar="N"
    ),
]
AskWitness = Annotated[
    bool,
    typer.Option("--witness", help="Let VTK draw the scan, too, and say whether it agrees. Needs pyvista."),
]
Devices = Annotated[
    Path | None,
    typer.Option(
        "--devices",
        help="Put into the report what devices have measured of this package: the folder that volprep view --devices "
        "fills.",
        metavar="FOLDER",
    ),
]
Quick = Annotated[bool, typer.Option("--quick", help="Check only schema, sizes and checksums, without OpenGL.")]

Curves = Annotated[
    bool,
    typer.Option(
        "--curves",
        help="Measure every choice, too: error against time or bytes of each variant, some ninety packages. "
        "Takes minutes.",
    ),
]

Ablate = Annotated[
    bool,
    typer.Option(
        "--ablate",
        help="Measure what each item of the package is worth, too: take out each that it has, put in each that it has "
        "not, some fifteen packages. Takes minutes.",
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
    as_json: Json = False,
) -> None:
    """Prove a package: make it again from the scan, draw it, compare both with what it holds, and write a report.

    The truth of pictures is the integral of the scan in double precision. Exit status 0: every byte follows from the
    scan, everything that ships was drawn, and every view is within the scene's tolerance; with --ablate also: each
    item is worth its place. 1: something is not. 5: the package is not whole.
    """
    if quick:
        _check(package, as_json=as_json)
        return
    from volprep.report.validate import validate as validate_package
    from volprep.validation.folder import default_report_path

    folder = report or default_report_path(package)
    with progress() as watcher:
        result = validate_package(
            package,
            folder,
            watcher,
            source=source,
            picture_size=size,
            witness=witness,
            devices=devices,
            curves=curves,
            ablate=ablate,
        )
    if as_json:
        print_json(result.model_dump(mode="json"))
    else:
        _print(result, folder)
    if not result.verdict.passed:
        end_beyond(_why_not(result, package, folder), as_json=as_json)
    faults = result.ablation.faults if result.ablation is not None else ()
    if faults:
        fields = {"count": len(faults), "listed": ", ".join(faults), "report": folder / "ablation.html"}
        end_beyond(VolprepError("VP6081", path=package, **fields), as_json=as_json)


def _check(package: Path, *, as_json: bool) -> None:
    from volprep.validation.whole import open_whole

    manifest = open_whole(package).manifest
    if as_json:
        print_json({"package": str(package), "whole": True, "files": len(manifest.files)})
    else:
        print_line(f"{package}: whole, {len(manifest.files)} files")


def _print(report: "Report", folder: Path) -> None:
    for program in report.programs:
        print_line(f"{program.program}, transfer function {program.transfer}, level {program.level}")
        _print_views(program, report.oracle_tolerance)
        print_line("")
        print_line(f"error against run time, view {program.sweep.view}")
        _print_sweep(program)
        if program.others:
            _print_others(program.others)
        if program.empty_space is not None:
            _print_empty_space(program.empty_space)
        print_line("")
    allowed = report.tolerance
    if report.witness is not None:
        _print_witness(report.witness)
    if report.ablation is not None:
        _print_ablation(report.ablation)
    if report.derivation is not None:
        print_line(f"made again from the scan and compared: {report.derivation.files} files")
    if report.verdict.previews:
        print_line(f"levels for previews only, told and not judged: {_previews(report.verdict)}")
    print_line(f"allowed: RMSE {allowed.rmse:g}, largest {allowed.maximum:g}; {report.driver.renderer}")
    print_line(f"report: {folder / 'index.html'}")


def _print_views(program: "ProgramResult", bound: float) -> None:
    from volprep.report.text import error

    rows = [
        (
            view.view,
            error(view.total.rmse, bound),
            error(view.total.maximum, bound),
            error(view.data.rmse, bound),
            error(view.drawing.rmse, bound),
            f"{min(view.total.ssim_black, view.total.ssim_white):.4f}",
            "within" if view.passed else "beyond",
        )
        for view in program.views
    ]
    print_table(("view", "RMSE", "largest", "data RMSE", "drawing RMSE", "SSIM", "verdict"), rows)


def _print_sweep(program: "ProgramResult") -> None:
    from volprep.report.text import number, ratio

    rows = [
        (
            str(point.level),
            f"{ratio(point.step_ratio)} {number(point.step_mm)} mm",
            number(point.samples_mean),
            number(point.draw_ms),
            number(point.total.rmse),
            number(point.drawing.rmse),
        )
        for point in program.sweep.points
    ]
    print_table(("level", "step", "samples", "ms", "RMSE", "drawing RMSE"), rows)


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
            number(max(view.maximum for view in other.views)),
            ("within" if other.passed else "beyond") + (", for previews" if other.preview_only else ""),
        )
        for other in others
    ]
    print_table(("drawn", "program", "pixels", "RMSE", "largest", "verdict"), rows)


def _previews(verdict: "Verdict") -> str:
    from volprep.report.text import number

    return ", ".join(f"{each.item} has RMSE {number(each.rmse)}" for each in verdict.previews)


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
    for each in witness.missing:
        print_line(f"not witnessed: {each.item}: {each.reason}")
    print_line("")


def _print_empty_space(found: "EmptySpace") -> None:
    from volprep.report.text import number

    plain = found.ways[0]
    rows = [
        (
            way.way,
            "–" if way.samples_mean is None else number(way.samples_mean),
            number(way.draw_ms),
            f"{plain.draw_ms / way.draw_ms:.2f} ×",
            number(way.difference),
        )
        for way in found.ways
    ]
    print_line("")
    print_line("empty space, as the package draws last")
    print_table(("left out by", "samples", "ms", "faster", "largest difference"), rows)


def _print_ablation(found: "Ablation") -> None:
    from volprep.validation.ablation.records import Measurement, name_of

    packages: list[tuple[str, str, Measurement | None, float | None]] = [("as planned", "", found.planned, None)]
    if found.everything is not None:
        packages.append(("with everything", "", found.everything, None))
    packages += [
        (f"{'without' if row.kept else 'with'} {name_of(row)}", row.outcome, row.other, row.change_maximum)
        for row in found.rows
    ]
    rows = [
        (name, *_measured(other), "" if change is None else f"{change:.2g}", outcome)
        for name, outcome, other, change in packages
    ]
    print_line("leaving out: each package beside the one as planned")
    heads = ("package", "bytes", "upload", "GPU memory", "ms", "times as long", "RMSE", "changes a view", "outcome")
    print_table(heads, rows)
    print_line("")


def _measured(other: "Measurement | None") -> tuple[str, ...]:
    from volprep.report.text import number

    if other is None:
        return ("",) * 6
    ratio = "1" if other.ratio is None else f"{other.ratio.median:.2f} ({other.ratio.low:.2f}–{other.ratio.high:.2f})"
    sizes = (bytes_text(size) for size in (other.package_bytes, other.upload_bytes, other.gpu_bytes))
    return (*sizes, number(other.milliseconds), ratio, number(other.rmse))


def _why_not(report: "Report", package: Path, folder: Path) -> VolprepError:
    verdict = report.verdict
    if report.derivation is not None and report.derivation.findings:
        from volprep.validation.exact.findings import error_of

        return error_of(report.derivation.findings, package)
    if verdict.unproved:
        return VolprepError("VP6032", path=package, listed=", ".join(verdict.unproved))
    if verdict.disagreeing and not verdict.failed:
        return VolprepError("VP6042", path=package, programs=", ".join(verdict.disagreeing), report=folder)
    if verdict.changed and not verdict.failed:
        return VolprepError("VP6015", path=package, programs=", ".join(verdict.changed), report=folder)
    if verdict.failed:
        return _beyond(report, package, folder)
    return VolprepError("VP6035", path=package, listed=", ".join(verdict.beyond), report=folder)


def _beyond(report: "Report", package: Path, folder: Path) -> VolprepError:
    verdict, allowed = report.verdict, report.tolerance
    fields = {
        "path": package,
        "failed": verdict.failed,
        "views": verdict.views,
        "view": verdict.worst_view,
        "program": verdict.worst_program,
        "rmse": verdict.worst_rmse,
        "rmse_allowed": allowed.rmse,
        "maximum": verdict.worst_maximum,
        "maximum_allowed": allowed.maximum,
        "report": folder,
    }
    sweep = next(each.sweep for each in report.programs if each.program == verdict.worst_program)
    parts = sweep.breakdown
    if parts.texels is not None and parts.angle is not None and parts.target is not None:
        of_slices = {"texels": parts.texels.rmse, "angle": parts.angle.rmse, "target": parts.target.rmse}
        return VolprepError("VP6016", **fields, **of_slices, part_view=sweep.view)
    return VolprepError("VP6011", **fields, data=verdict.worst_data_rmse, drawing=verdict.worst_drawing_rmse)
