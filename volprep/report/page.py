"""index.html: one page that needs nothing from outside its folder, made from the report's data alone."""

from collections.abc import Sequence
from dataclasses import dataclass

from volprep.compositing import COMPOSITINGS
from volprep.report import text
from volprep.report.canvas import Plot
from volprep.report.devices import device_parts
from volprep.report.environment import environment
from volprep.report.plots import error_against_size, error_against_step, error_against_time, plain_bytes, transfer_plot
from volprep.report.study import Study
from volprep.report.verdict_words import SEEN_FROM, verdict_lines
from volprep.validation.comparison.colours import colours, css_bytes
from volprep.validation.folder import STUDIES
from volprep.validation.results.measurements import ProgramResult, SweepPoint, ViewResult, WayName
from volprep.validation.results.report import Report
from volprep_formats.package.channels import channel_views
from volprep_formats.package.manifest import Manifest, Tolerance
from volprep_formats.readers import title_of

_WAYS: dict[WayName, str] = {"neither": "neither", "table": "skip table", "mesh": "proxy mesh", "both": "both"}


@dataclass(frozen=True)
class ProgramPlots:
    """The plots of one program."""

    time: Plot
    step: Plot


def page(report: Report, studies: Sequence[Study] = ()) -> str:
    """Write the page of `report` as HTML. Its pictures lie beside it under the names in the report.

    The pages of `studies` lie in a folder beside it.
    """
    manifest = report.package.manifest
    return (
        environment(report.oracle_tolerance)
        .get_template("report.html.j2")
        .render(
            report=report,
            study_pages={study.title: f"{STUDIES}/{study.name}.html" for study in studies},
            manifest=manifest,
            plots={program.program: _plots(program, report) for program in report.programs},
            transfer_plots=_transfer_plots(manifest),
            size_plot=error_against_size(report),
            plain_bytes=plain_bytes(manifest) if report.forms else 0,
            seen_from=SEEN_FROM,
            kept=[item for item in manifest.plan if item.kept],
            left_out=[item for item in manifest.plan if not item.kept],
            files=manifest.files,
            file_bytes={record.path: record.size_bytes for record in manifest.files},
            way_names=_WAYS,
            source_bytes=report.cost.source_bytes,
            hero=_hero(report),
            kind=_kind(manifest),
            truth=_truth(manifest),
            in_words=_in_words(report.tolerance),
            verdict_lines=verdict_lines(report.verdict),
            nominal=[_nominal(program) for program in report.programs],
            legend=_legend(report.difference_gain),
            beside=_beside(report),
            device_parts=device_parts(report),
        )
    )


def _plots(program: ProgramResult, report: Report) -> ProgramPlots:
    return ProgramPlots(time=error_against_time(program, report), step=error_against_step(program, report))


def _transfer_plots(manifest: Manifest) -> dict[str, Plot]:
    plots = [_plots_of_channel(view) for view in channel_views(manifest).values()]
    return {name: plot for named in plots for name, plot in named.items()}


def _plots_of_channel(manifest: Manifest) -> dict[str, Plot]:
    unit = manifest.source.info.unit
    window = (
        manifest.quantization.window
        if manifest.quantization
        else (manifest.statistics.minimum, manifest.statistics.maximum)
    )
    return {
        function.name: transfer_plot(function, window, unit, manifest.opaque_length_mm(function))
        for function in manifest.transfer_functions
    }


def _nominal(program: ProgramResult) -> SweepPoint:
    """Return the measured point of the finest level whose step is nearest to the nominal one."""
    return min(program.sweep.of_level(program.level), key=lambda point: abs(point.step_ratio - 1))


def _hero(report: Report) -> ViewResult:
    """Return the view that the page opens with: the one of the sweep, which is oblique and shows the most."""
    first = report.programs[0]
    return next(view for view in first.views if view.view == first.sweep.view)


def _beside(report: Report) -> list[tuple[ProgramResult, ViewResult, SweepPoint]]:
    """Return the picture of several channels and one of each channel, in the view of the sweep.

    Empty for a colour volume, whose channels are not drawn apart.
    """
    shared = [picture for picture in report.package.manifest.pictures if picture.mixing == "sum"]
    by_transfer = {program.transfer: program for program in report.programs}
    wanted = [name for picture in shared for name in (picture.name, *(medium.transfer for medium in picture.media))]
    found = [by_transfer[name] for name in wanted] if by_transfer.keys() >= {*wanted} else []
    return [
        (program, next(view for view in program.views if view.view == program.sweep.view), _nominal(program))
        for program in found
    ]


def _kind(manifest: Manifest) -> str:
    """Return the kind of scan, with its article."""
    info = manifest.source.info
    name = title_of(info.format)
    name = f"{name} ({info.modality})" if info.modality else name
    more = len(manifest.channels) - 1
    return f"{name} and {more} more {'channel' if more == 1 else 'channels'}" if more else name


def _truth(manifest: Manifest) -> str:
    """Return the name of the reference that pictures are compared with."""
    drawn = [COMPOSITINGS[program.compositing] for program in manifest.programs]
    return (drawn or [COMPOSITINGS["emission-absorption"]])[0].truth


def _in_words(tolerance: Tolerance) -> str:
    """Return the visible error that the tolerance allows."""
    if tolerance.flip <= 0.03:
        told = "An attentive person who flips between a picture within this tolerance and the truth sees no difference"
    elif tolerance.flip <= 0.1:
        told = "A person who flips between a picture within this tolerance and the truth may see differences"
    else:
        told = "A picture within this tolerance may differ plainly from the truth"
    kept = f"and no thin or small structure loses more than {1 - tolerance.kept_light:.0%} of its light"
    return f"{told} (FLIP {tolerance.flip:g}, RMSE {tolerance.rmse:g} over seen pixels), {kept}."


def _legend(gain: float) -> list[tuple[str, str]]:
    """Return the legend of the difference pictures: CSS colour and label of some grades, from none to clipped."""
    return [(css_bytes(colours()[grade]), text.number(grade / 255 / gain, 2)) for grade in range(0, 256, 51)]
