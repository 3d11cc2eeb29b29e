"""Run a validation: draw the package, draw the truth, compare, judge."""

import hashlib
import resource
import sys
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

from volprep.kernels import _native
from volprep.pipeline.origin import read_origin
from volprep.pipeline.remarks import warnings
from volprep.plan.form_trial import FormTrial
from volprep.plan.level_choice import LevelChoice
from volprep.scene.channels import drawn_channels
from volprep.truth.decoded import light_of_scan
from volprep.truth.oracle import DEFAULT_TOLERANCE
from volprep.validation.bench import Bench
from volprep.validation.checks.consistency import open_whole
from volprep.validation.checks.fidelity import fidelity_findings
from volprep.validation.checks.traced_light import measure_cut_light, measure_light
from volprep.validation.comparison.coarse_levels import judge_others, unproved
from volprep.validation.comparison.frames import with_later_frames
from volprep.validation.comparison.kept_light import kept_light
from volprep.validation.comparison.level_comparison import compare_levels
from volprep.validation.comparison.preview import preview_findings
from volprep.validation.comparison.references import References, draw_references
from volprep.validation.comparison.slices import measure_slices
from volprep.validation.comparison.truth import write_truth
from volprep.validation.comparison.views import (
    MeasuredPrograms,
    Statement,
    ViewedProgram,
    draw_differences,
    measure_views,
)
from volprep.validation.exact.derive import Derived, derive
from volprep.validation.exact.findings import error_of
from volprep.validation.folder import PICTURES, ReportFolder
from volprep.validation.results.measurements import Derivation, ProgramResult
from volprep.validation.results.report import Cost, PackageFacts, Report
from volprep.validation.results.seen import KeptLight, as_order
from volprep.validation.subjects.labelled import LabelledSubject
from volprep.validation.subjects.scan import Judge, find_scan
from volprep.validation.subjects.subject import Subject
from volprep.validation.timing.clock import Clock
from volprep.validation.timing.empty_space import measure_empty_space, ways_of
from volprep.validation.timing.sweep import SWEEP_VIEW, measure_sweep, nominal_time
from volprep.validation.verdicts.verdict import judge
from volprep.validation.witness.judge import ask_witness
from volprep.validation.witness.records import NotWitnessed, Witness
from volprep.validation.witness.second_reading import SecondReading, read_again
from volprep.validation.witness.step_checks import check_steps
from volprep.vtk.layouts import draw_figure
from volprep.vtk.process import has_pyvista
from volprep_formats.diagnostics import VolprepError
from volprep_formats.installation import generator
from volprep_formats.package.channel_packages import channel_packages, package_of_transfer
from volprep_formats.package.check import data_of_others
from volprep_formats.package.manifest import Manifest, Tolerance
from volprep_formats.package.picture import Picture
from volprep_formats.package.program import PictureProgram, Program
from volprep_formats.package.reader import Package
from volprep_formats.package.storage.contents import open_contents
from volprep_formats.package.storage.files import MANIFEST
from volprep_formats.progress import Progress
from volprep_formats.source import ChannelSpec


def measure_package(
    path: Path,
    folder: ReportFolder,
    scratch: Path,
    progress: Progress,
    *,
    source: Path | None = None,
    picture_size: int | None = None,
    witness: bool = False,
) -> Report:
    """Measure the sealed package at `path`; pictures go to `folder`, the scan and its codes to the empty `scratch`.

    With `witness`, VTK draws the scan, too, and independent libraries read it.

    Raises the errors of `volprep.report.validate`.
    """
    clock = Clock()
    with clock.part("all"):
        with clock.part("checking"):
            package = open_whole(path)
        found = find_scan(path, source)
        derived = _derived(package, found, scratch, clock, progress)
        size = picture_size or found.picture_size_of([scan.grid for scan in derived.scans.values()])
        derivation = derived.record
        whole = _judged(package, derived.manifest, found.scene.tolerance)
        package = whole.at_frame(0)
        channels = {name: Subject(part, derived.scans[name], size) for name, part in channel_packages(package).items()}
        subjects = [*_together(package, channels, found), *_labelled(package, derived, size), *channels.values()]
        subject = subjects[0]
        benches = [Bench(subject, folder, clock, progress) for subject in subjects]
        try:
            measured = _measure(benches)
            programs = with_later_frames(measured.programs, whole, derived.later_frames, benches[0])
        except VolprepError as error:
            if not derivation.findings:
                raise
            # A fault in the package explains more than a driver's result for it.
            raise error_of(derivation.findings, path) from error
        asked = _witnessed(path, source, channels, measured, scratch) if witness else None
        layout = _layout_picture(package, folder) if witness and has_pyvista() else None
        return Report(
            generator=generator(),
            package=_facts(package),
            picture_size=subject.shape_hw[0],
            target="rgba8",
            step_mm=subject.step_mm,
            tolerance=subject.render.tolerance,
            oracle_tolerance=DEFAULT_TOLERANCE,
            difference_gain=measured.gain,
            verdict=judge(
                programs,
                subject.render.tolerance,
                differing=derivation.items,
                unproved=unproved(package.manifest, programs),
                disagreeing=() if asked is None else asked.disagreeing,
                contradicted=() if asked is None else asked.contradicted,
                unwitnessed=None if asked is None else asked.unwitnessed,
            ),
            warnings=(*warnings(package.manifest), *data_of_others(package)),
            derivation=derivation,
            witness=asked,
            layout_picture=layout,
            programs=programs,
            made=_made(path),
            forms=_forms(path, package.manifest),
            driver=measured.driver,
            cost=_cost(clock, channels),
        )


def _derived(package: Package, found: Judge, scratch: Path, clock: Clock, progress: Progress) -> Derived:
    """Make the package again from its scan; findings about its preview and its error statements are in the record."""
    with clock.part("deriving"):
        derived = derive(package, found, scratch, progress)
        derivation = _with_preview(derived.record, package)
    if not derivation.findings and (
        found.scene.fidelity or any(drawing.fidelity for _, drawing in package.manifest.drawings)
    ):
        with clock.part("fidelity"):
            stated = fidelity_findings(package, derived.scans, wanted=found.scene.fidelity)
            derivation = derivation.with_findings(stated)
    if {channel.name for channel in package.manifest.channels} != derived.scans.keys():
        raise error_of(derivation.findings, package.path)
    return replace(derived, record=derivation)


def _with_preview(derivation: Derivation, package: Package) -> Derivation:
    """Return the derivation with the findings of the preview. Raises errors of drawing if nothing else is found."""
    try:
        return derivation.with_findings(preview_findings(package))
    except VolprepError as error:
        if not derivation.findings:
            raise
        raise error_of(derivation.findings, package.path) from error


def _judged(package: Package, derived: Manifest, tolerance: Tolerance) -> Package:
    """Return the package with the scan's tolerance, and with "for previews only" marks that follow from the scan.

    The package's own claims do not count.
    """
    manifest = package.manifest
    if manifest.render is None:
        return package
    render = manifest.render.model_copy(update={"tolerance": tolerance})
    previews = {(picture.name, drawing.level): drawing.preview_only for picture, drawing in derived.drawings}
    pictures = tuple(_with_previews(picture, previews) for picture in manifest.pictures)
    return Package(package.path, manifest.model_copy(update={"render": render, "pictures": pictures}))


def _with_previews(picture: Picture, previews: Mapping[tuple[str, int], bool | None]) -> Picture:
    drawings = tuple(
        drawing.model_copy(update={"preview_only": previews.get((picture.name, drawing.level))})
        for drawing in picture.drawings
    )
    return picture.model_copy(update={"drawings": drawings})


def _together(package: Package, channels: Mapping[str, Subject], found: Judge) -> Iterator[Subject]:
    """Return the subject of the picture of several channels, if there is one."""
    specs = {channel.name: channel.spec for channel in drawn_channels(found.scene)}
    placed = {name: spec.affine for name, spec in specs.items() if isinstance(spec, ChannelSpec)}
    for picture in package.manifest.pictures:
        if picture.mixing in {"sum", "colour"}:
            drawn = {medium.transfer: channels[medium.channel] for medium in picture.media}
            first = channels[picture.media[0].channel]
            registered = {medium.transfer: placed.get(medium.channel) for medium in picture.media}
            own = package_of_transfer(package, picture.name)
            yield Subject(own, first.scan, first.shape_hw[0], drawn, registered)


def _labelled(package: Package, derived: Derived, size: int) -> Iterator[Subject]:
    """Return the subject of a scan with its segments, where there are any."""
    for segments, labels in derived.labels:
        # The view of its channel holds no program of the picture.
        scan = replace(derived.scans[derived.manifest.channels[0].name], normals=light_of_scan(package.manifest))
        yield LabelledSubject(package, scan, size, labels, segments)


def _measure(benches: list[Bench]) -> MeasuredPrograms:
    """Measure all programs of all channels."""
    if not benches[0].subject.package.manifest.programs:
        return measure_slices(benches[0])
    programs = [(bench, program) for bench in benches for program in bench.subject.programs]
    viewed = [measure_views(bench, program, SWEEP_VIEW) for bench, program in programs]
    gain = draw_differences(viewed, benches[0].folder)
    references = {id(bench): draw_references(bench, bench.subject.programs) for bench in benches}
    results = tuple(
        _result(bench, program, views, references[id(bench)])
        for (bench, program), views in zip(programs, viewed, strict=True)
    )
    write_truth(benches[0], zip((bench for bench, _ in programs), viewed, results, strict=True))
    statements = tuple(Statement(*program, views) for program, views in zip(programs, viewed, strict=True))
    return MeasuredPrograms(results, gain, viewed[0].driver, statements)


def _result(bench: Bench, program: PictureProgram, views: ViewedProgram, references: References) -> ProgramResult:
    """Measure one program; its standard views are known."""
    others, kept_by_levels = judge_others(bench, program, views, references)
    ways = ways_of(bench.subject, program)
    with ExitStack() as stack:
        # The last way is how the package is drawn: the sweep draws it with the nominal step.
        opened = {way.name: stack.enter_context(way.open(views.level)) for way in ways[:-1]}
        sweep, times = measure_sweep(bench, program, views, opened)
    if ways:
        times[ways[-1].name] = nominal_time(sweep, views.level)
    return ProgramResult(
        program=program.name,
        technique=program.technique,
        transfer=program.transfer,
        level=views.level,
        views=views.views,
        sweep=sweep,
        levels=compare_levels(bench, program, views, references),
        empty_space=measure_empty_space(bench, program, views, ways, times),
        light=measure_light(bench, program),
        cut_light=measure_cut_light(bench, program),
        others=others,
        kept_light=(*_kept_by_finest(bench, program, views), *kept_by_levels),
    )


def _kept_by_finest(bench: Bench, program: PictureProgram, viewed: ViewedProgram) -> Iterator[KeptLight]:
    least = min(viewed.views, key=lambda view: as_order(view.seen))
    shown = viewed.drawn[least.view], viewed.truths[least.view]
    found = kept_light(bench.folder, program.name, viewed.level, least.view, least.seen, shown, None)
    if found is not None:
        yield found


def _witnessed(
    path: Path, source: Path | None, channels: Mapping[str, Subject], measured: MeasuredPrograms, scratch: Path
) -> Witness:
    """Ask VTK, and read scan, scene and package a second time."""
    asked = ask_witness(measured.statements, SWEEP_VIEW, scratch)
    again = reread(path, source, channels, measured)
    return asked.model_copy(update={"checks": tuple(again.checks), "missing": (*asked.missing, *again.missing)})


def reread(
    path: Path, source: Path | None, channels: Mapping[str, Subject], measured: MeasuredPrograms
) -> SecondReading:
    """Read scan, scene and package a second time, and check that finer steps reach the truth; without VTK."""
    again = read_again(path, source, channels, measured.statements)
    manifests = [statement.bench.subject.package.manifest for statement in measured.statements]
    programs = {program.name: (manifest, program) for manifest in manifests for program in manifest.programs}
    unfiltered = [name for name, drawn in programs.items() if _has_unfiltered_normals(*drawn)]
    reason = "its normals are normals of voxels, and the truth has normals between them"
    again.missing += [NotWitnessed(item=f"steps of {name}", reason=reason) for name in unfiltered]
    known = {name: drawn[1].classification for name, drawn in programs.items() if name not in unfiltered}
    again.checks += check_steps(measured.programs, known)
    return again


def _has_unfiltered_normals(manifest: Manifest, program: Program) -> bool:
    nearest = {texture.role for texture in manifest.textures if texture.filter == "nearest"}
    reads = program.lighting != "none" and program.normals_from == "volume"
    return reads and "normals" in nearest and "volume" not in nearest


def _layout_picture(package: Package, folder: ReportFolder) -> str | None:
    """Write the figure of how the package lays out its volume; None if there is no such layout."""
    picture = draw_figure(package)
    if picture is None:
        return None
    name = f"{PICTURES}/layout.png"
    folder.picture(name, picture)
    return name


def _made(path: Path) -> tuple[LevelChoice, ...]:
    origin = read_origin(path.resolve())
    return () if origin is None else origin.levels


def _forms(path: Path, manifest: Manifest) -> tuple[FormTrial, ...]:
    """Compressed forms of the manifest, with the times that the build noted beside the package."""
    origin = read_origin(path.resolve())
    noted = {form.as_record: form for form in (() if origin is None else origin.forms)}
    plain = (FormTrial.model_validate(form.model_dump()) for form in manifest.compression)
    return tuple(noted.get(form.as_record, form) for form in plain)


def _facts(package: Package) -> PackageFacts:
    with open_contents(package.path, MANIFEST) as contents:
        manifest = contents.read()
    return PackageFacts(
        file_name=package.path.resolve().name,
        manifest_sha256=hashlib.sha256(manifest).hexdigest(),
        size_bytes=len(manifest) + sum(record.size_bytes for record in package.manifest.files),
        manifest=package.manifest,
    )


def _cost(clock: Clock, channels: Mapping[str, Subject]) -> Cost:
    return Cost(
        seconds=clock.so_far(),
        threads=_native.max_threads(),
        peak_memory_bytes=_peak_memory_bytes(),
        source_bytes=sum(channel.scan.stored.nbytes for channel in channels.values()),
    )


def _peak_memory_bytes() -> int:
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else peak * 1024
