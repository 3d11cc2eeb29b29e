"""Take each item out of a package, add each item that was left out, and measure the changes."""

import math
import re
import time
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path

from volprep.lab.ablation.gauge import PackageGauge
from volprep.lab.ablation.judge import MOST_CHANGE, judged_added, judged_without, level_outcome, table_outcome
from volprep.lab.ablation.records import Ablation, AblationRow, Measurement, Outcome
from volprep.lab.small_scan import read_scan, write_scan
from volprep.lab.variants import Workshop, first_channel, merged, with_changes
from volprep.parts.ablation import AblationItem, Changes
from volprep.parts.registry import PARTS
from volprep.plan.item_kinds import LEVEL, OWN_TABLE, PREVIEW
from volprep.render.renderers import ray_caster_of
from volprep.scene.channels import drawn_channels, left_out
from volprep.scene.request import Request
from volprep.truth.decoded import light_of_scan, own_table
from volprep.validation.comparison.altered import with_common_tables
from volprep.validation.exact.manifests import manifest_differences
from volprep.validation.subjects.scan import Judge
from volprep.validation.timing.sweep import SWEEP_VIEW
from volprep_formats.diagnostics import VolprepError
from volprep_formats.installation import generator
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.reader import Package
from volprep_formats.progress import Progress

ITEMS: tuple[AblationItem, ...] = tuple(item for part in PARTS for item in part.ablations)


MOST_VOXELS = 2**24
"""Largest scan that is measured as it is; of a larger one, means are: some fifteen packages are built."""

_MOST_PIXELS = 512
"""Width and height of pictures of levels."""


def measure_ablation(
    manifest: Manifest, judge: Judge, folder: Path, progress: Progress, picture_size: int | None = None
) -> Ablation:
    """Measure every item of the package that has `manifest`, with the scene of `judge`; `folder` is for files.

    Only the first channel is measured. Raises VP6080 for devices without shaders, VP3046 for one in colour, and the
    errors of building the scene itself; a variant that cannot be built is reported.
    """
    began = time.perf_counter()
    scene, first = first_channel(manifest, judge, "VP6080", "an ablation")
    others = drawn_channels(judge.scene)[1:]
    spec, reduced_by = write_scan(first.spec, folder / "scan.nrrd", progress, MOST_VOXELS)
    request = Request(with_changes(scene.with_source(spec), {"together": None}), judge.profile, judge.scene_path)
    bench = VariantBench(request, folder, picture_size or judge.picture_size)
    rows = tuple(bench.rows(progress))
    could = {row.item for row in rows if not row.kept and row.other is not None}
    added = [item for item in ITEMS if item.with_everything and item.name in could]
    everything = bench.everything(added)
    planned = bench.planned.manifest
    return Ablation(
        generator=generator(),
        package=manifest.name,
        profile=manifest.profile.name,
        transfers=bench.gauge.transfers,
        timed_view=SWEEP_VIEW,
        picture_size=bench.gauge.subject.shape_hw[0],
        reduced_by=reduced_by,
        shape_zyx=planned.levels[0].grid.shape_zyx,
        tolerance=judge.scene.tolerance,
        most_change=MOST_CHANGE,
        renderer=bench.gauge.renderer,
        clock=bench.gauge.clock,
        seconds=time.perf_counter() - began,
        planned=bench.measured_as_planned,
        noise=bench.noise,
        everything=None if everything is None else everything[1],
        everything_has=() if everything is None else tuple(item.name for item in added),
        rows=rows,
        not_measured=(
            "preview: a picture for people, which no other picture depends on",
            *(f"channel {channel.name}: the first one is measured" for channel in others),
            *(f"channel {name}: no transfer function is for it" for name in left_out(scene)),
        ),
    )


class VariantBench:
    """Builds variants and compares them with the package as planned."""

    def __init__(self, request: Request, folder: Path, picture_size: int) -> None:
        """Take a scene with its profile, an empty folder, and the width and height of pictures in pixels."""
        self._folder = folder
        self._workshop = Workshop(request, folder)
        self._tolerance = request.scene.tolerance
        self.scene = request.scene
        self.planned = self._workshop.make({}).package
        scan = read_scan(request.scene.source, light_of_scan(self.planned.manifest))
        self.gauge = PackageGauge(self.planned, scan, picture_size)
        alone = self.gauge.timed(self.planned, self.gauge.transfers)
        self.noise = alone.ratio
        self.measured_as_planned = self.gauge.measured(self.planned, self.gauge.transfers, alone.planned_ms)
        self._same = self._what_stays()

    def _what_stays(self) -> Changes:
        """Return the settings that variants share with the package as planned, so that they differ in one item alone.

        All have its step, and filters of levels are not chosen again, because that takes most of the time of a build.
        """
        manifest = self.planned.manifest
        voxel_mm = min(manifest.levels[0].grid.spacing_mm_zyx)
        same: dict[str, object] = {"render": {"step_voxels": self.gauge.subject.step_mm / voxel_mm}}
        if self.scene.pyramid.filter == "auto" and len(manifest.levels) > 1:
            same["pyramid"] = {"filter": manifest.levels[1].filter}
        return same

    def rows(self, progress: Progress) -> Iterator[AblationRow]:
        """Measure all items."""
        wanted = list(self._wanted())
        progress.start("leaving out", len(wanted) + 1)
        for item, transfer, kept in wanted:
            yield self._row(item, transfer, kept=kept)
            progress.advance()
        yield from self._levels()
        yield from self._own_tables()
        yield from self._undrawable()
        progress.advance()

    def left_out(self) -> list[AblationItem]:
        """Return the items of the package with everything that the planned one lacks."""
        names = {item.name for item, _, kept in self._wanted() if item.with_everything and not kept}
        return [item for item in ITEMS if item.name in names and item.added(self.scene) is not None]

    def _wanted(self) -> Iterator[tuple[AblationItem, str | None, bool]]:
        for item in ITEMS:
            for transfer in self.gauge.transfers if item.for_each_transfer else (None,):
                has = item.has(self.planned.manifest, transfer or self.gauge.transfers[0])
                if has is not None:
                    yield item, transfer, has

    def _row(self, item: AblationItem, transfer: str | None, *, kept: bool) -> AblationRow:
        transfers = self.gauge.transfers if transfer is None else (transfer,)
        changes = item.without if kept else item.added(self.scene)
        row = AblationRow(
            item=item.name,
            transfer=transfer,
            kept=kept,
            chosen_by=item.chosen_by(self.scene),
            reason=_reason(self.planned.manifest, item.kind, transfer),
            other=None,
            outcome="not available",
            finding="no scene has it that does not have it already",
        )
        if changes is None:
            return row
        try:
            package = self._workshop.make(merged(self._same, changes)).package
            if item.has(package.manifest, transfers[0]) == kept:
                finding = "the plan makes the same package, whatever the scene says"
                return row.model_copy(update={"finding": finding})
            other, change_rmse, change_maximum = self._compared(package, transfers)
        except VolprepError as error:
            return row.model_copy(update={"finding": self._told(error, row.item)})
        row = row.model_copy(update={"other": other, "change_rmse": change_rmse, "change_maximum": change_maximum})
        if not kept:
            planned = self._planned_for(transfers)
            return judged_added(row, item.gain(self.scene), planned, self._tolerance, lossy=item.lossy)
        differing = manifest_differences(package.manifest, self.planned.manifest)
        return judged_without(row, item.gain(self.scene), self._planned_for(transfers), self._tolerance, differing)

    def _compared(self, package: Package, transfers: Sequence[str]) -> tuple[Measurement, float, float]:
        timed = self.gauge.timed(package, transfers)
        measured = self.gauge.measured(package, transfers, timed.other_ms, timed.ratio)
        return measured, *self.gauge.change(package, transfers)

    def _planned_for(self, transfers: Sequence[str]) -> Measurement:
        if tuple(transfers) == self.gauge.transfers:
            return self.measured_as_planned
        return self.gauge.measured(self.planned, transfers, self.measured_as_planned.milliseconds)

    def everything(self, added: Sequence[AblationItem]) -> tuple[Package, Measurement] | None:
        """Make the package with all of these items put in; None if there are no items or it cannot be built."""
        changes: Changes = self._same
        for item in added:
            changes = merged(changes, item.added(self.scene) or {})
        if not added:
            return None
        try:
            package = self._workshop.make(changes).package
        except VolprepError:
            return None
        timed = self.gauge.timed(package, self.gauge.transfers)
        return package, self.gauge.measured(package, self.gauge.transfers, timed.other_ms, timed.ratio)

    def _levels(self) -> Iterator[AblationRow]:
        """Compare each coarse level with the next finer one, which an app would draw without it."""
        manifest = self.planned.manifest
        transfer = self.gauge.transfers[0]
        picture = manifest.picture(transfer)
        uploads = {drawing.level: drawing.cost for drawing in picture.drawings} if picture is not None else {}
        drawn = [*uploads]
        for finer, level in pairwise(drawn):
            # The planned package draws the level in question, the other package draws the level that replaces it.
            timed = self.gauge.timed(self.planned, (transfer,), (level, finer))
            rmse, maximum = self.gauge.errors(self.planned, transfer, finer)
            files = sum(self._bytes_of(texture.file) for texture in manifest.textures_of(level=level))
            other = Measurement(
                package_bytes=self.measured_as_planned.package_bytes - files,
                transport_bytes=self.measured_as_planned.transport_bytes,
                upload_bytes=uploads[finer].upload_bytes,
                gpu_bytes=uploads[finer].gpu_bytes,
                milliseconds=timed.other_ms,
                ratio=timed.ratio,
                rmse=rmse,
                maximum=maximum,
            )
            row = _planned(f"level {level}", _reason(manifest, LEVEL, None, level), transfer, other)
            yield level_outcome(row, finer, uploads[level].upload_bytes)

    def _own_tables(self) -> Iterator[AblationRow]:
        """Draw levels that have a lookup table of their own with the common one."""
        manifest = self.planned.manifest
        without = with_common_tables(self.planned)
        gauge = self._gauge_for_levels()
        for transfer in self.gauge.transfers:
            for level in (level.index for level in manifest.levels):
                if not own_table(self.planned, transfer, level):
                    continue
                row = _planned(f"own table of level {level}", _reason(manifest, OWN_TABLE, transfer, level), transfer)
                own = gauge.level_error(self.planned, transfer, level)
                yield table_outcome(row, own, gauge.level_error(without, transfer, level))

    def _gauge_for_levels(self) -> PackageGauge:
        """Return a gauge whose pictures have two rays along each voxel of level 1: fewer would measure chance."""
        coarser = self.planned.manifest.levels[1:]
        if not coarser:
            return self.gauge
        voxels = math.hypot(*coarser[0].grid.extent_mm_zyx) / min(coarser[0].grid.spacing_mm_zyx)
        pixels = min(_MOST_PIXELS, 2 * round(voxels))
        subject = self.gauge.subject
        return self.gauge if pixels <= subject.shape_hw[0] else PackageGauge(self.planned, subject.scan, pixels)

    def _undrawable(self) -> Iterator[AblationRow]:
        """Remove data that no other item covers: textures and shaders that a program cannot draw without."""
        manifest = self.planned.manifest
        for item in manifest.plan:
            files = set(item.files)
            volumes = (texture for texture in manifest.textures_of("volume") if texture.file in files)
            levels = {texture.level for texture in volumes} - {manifest.levels[0].index}
            known = {PREVIEW, OWN_TABLE, *(tried.kind for tried in ITEMS)}
            if not item.kept or not files or levels or item.kind in known:
                continue
            yield _planned(item.name, item.reason, found=self._drawn_without(item.name, files))

    def _drawn_without(self, name: str, files: set[str]) -> tuple[Outcome, str]:
        manifest = self.planned.manifest
        kept = {
            "textures": tuple(texture for texture in manifest.textures if texture.file not in files),
            "programs": tuple(program for program in manifest.programs if files.isdisjoint(program.shaders)),
        }
        without = Package(self.planned.path, manifest.model_copy(update=kept), self.planned.channel)
        for program in self.gauge.subject.programs:
            try:
                kind = ray_caster_of(without, min(program.levels), program.transfer)
                with kind(without, level=min(program.levels), transfer=program.transfer):
                    pass
            except VolprepError as error:
                return "earns its place", f"without it: {self._told(error, name)}"
        return "does not earn its place", "everything is drawn without it"

    def _told(self, error: VolprepError, item: str) -> str:
        """Return code and text of an error, with the item in place of a file that is gone after the measurement."""
        text = re.sub(rf"{re.escape(str(self._folder))}[^\s:,]*", lambda _: item, error.summary)
        return f"{error.code} {text}"

    def _bytes_of(self, path: str) -> int:
        return next(record.size_bytes for record in self.planned.manifest.files if record.path == path)


def _planned(
    item: str,
    reason: str | None,
    transfer: str | None = None,
    other: Measurement | None = None,
    found: tuple[Outcome, str] = ("not distinguishable", ""),
) -> AblationRow:
    """Return the row of an item that the plan keeps, with its outcome and finding."""
    return AblationRow(
        item=item,
        transfer=transfer,
        kept=True,
        chosen_by="plan",
        reason=reason,
        other=other,
        outcome=found[0],
        finding=found[1],
    )


def _reason(manifest: Manifest, kind: str, transfer: str | None, level: int | None = None) -> str | None:
    """Return the plan's reason for an item of this kind: that of the kept item, if there are several."""
    found = [
        item
        for item in manifest.plan
        if item.kind == kind and transfer in {None, item.transfer} and level in {None, item.level}
    ]
    said = next((item for item in found if item.kept), found[0] if found else None)
    return None if said is None else said.reason
