"""Build the package again from scene and scan with the build stages, and compare each result with the package.

Compared are: codes and their window, every texture, normals, skip tables, meshes, histograms, pieces, shaders, and the
manifest. A new part is compared as soon as it is a stage.

This finds every byte that this version would not make of the scan. It does not check the stages themselves, because it
runs the same code: the pictures, the witness and the tests, which compare each kernel with a slow twin, check those.
docs/VALIDATED.md lists what pictures and stages share.

If a filter of levels, or a compressed form, was chosen by trying several, the choice is taken from the record of
origin, or else from the manifest; the texels are derived with that choice.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from volprep.parts.registry import PARTS
from volprep.parts.segments.stage import labels_of_source
from volprep.parts.source_field import source_field
from volprep.parts.work import frame_drafts
from volprep.pipeline.import_draft import Imported, import_draft
from volprep.pipeline.plan_draft import plan_draft
from volprep.pipeline.prepare import prepare
from volprep.pipeline.seal import STAGE as SEAL
from volprep.pipeline.stage_graph import STAGES
from volprep.pipeline.stages import run_stage
from volprep.plan.records import ChannelPlan, LevelPlan, Plan
from volprep.scene.request import Request
from volprep.truth.volume import Volume
from volprep.validation.exact.draft import ComparingDraft
from volprep.validation.exact.findings import findings_of
from volprep.validation.results.measurements import Derivation
from volprep.validation.subjects.scan import Judge
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.channels import channel_views
from volprep_formats.package.manifest import Manifest, PlanItem
from volprep_formats.package.parts.segments.record import Segments
from volprep_formats.package.reader import Package
from volprep_formats.package.storage.draft import Draft
from volprep_formats.progress import Progress
from volprep_formats.record import present


@dataclass(frozen=True)
class Derived:
    """Contents derived from scene and scan."""

    record: Derivation
    """Compared items, and their differences."""
    manifest: Manifest
    """The manifest that follows, as that of a draft."""
    scans: dict[str, Volume]
    """The scan of each channel at full precision, files that the system maps into memory."""
    later_frames: tuple[dict[str, Volume], ...] = ()
    """The same of each later frame of a series."""
    labels: tuple[tuple[Segments, NDArray[np.uint16]], ...] = ()
    """Segments, and their labels [z, y, x], numbered as in the package; empty if it has none."""


def derive(package: Package, found: Judge, folder: Path, progress: Progress) -> Derived:
    """Make `package` again in the empty folder `folder`, which then holds the scan, and compare.

    Raises the errors of reading the scan and of planning, VP6013 if it is not the scan that the package names, VP4020
    if there is no room for the scan and its codes.
    """
    request = Request(found.scene, found.profile, found.scene_path)
    imported = import_draft(prepare(request), folder, progress)
    _require_same_scan(package.manifest, imported.draft.manifest, found)
    draft = ComparingDraft(imported.draft.folder, imported.draft.manifest, package)
    plan = _plan(draft, imported, package.manifest, found, progress)
    for stage in STAGES:
        if stage is not SEAL and stage.name in plan.stages:
            run_stage(draft, stage, plan, imported.scene, progress)
    return Derived(
        record=Derivation(
            files=len(draft.compared),
            size_bytes=sum(draft.compared.values()),
            findings=tuple(findings_of(package, draft, _settled(draft, plan))),
        ),
        manifest=draft.manifest,
        scans=_scans(draft),
        later_frames=tuple(_scans(frame) for frame in frame_drafts(draft)),
        labels=tuple(
            (segments, labels_of_source(draft, segments, draft.manifest.source.info.grid))
            for segments in present(plan.segments)
        ),
    )


def _scans(draft: Draft) -> dict[str, Volume]:
    return {name: source_field(draft, view) for name, view in channel_views(draft.manifest).items()}


def _settled(draft: ComparingDraft, plan: Plan) -> tuple[PlanItem, ...]:
    """Return the items of the plan with the decisions that only the data could make."""
    items = plan.items
    for part in PARTS:
        items = part.settle(items, draft, plan)
    return items


def _require_same_scan(manifest: Manifest, derived: Manifest, found: Judge) -> None:
    for one, other in zip(manifest.channels, derived.channels, strict=False):
        if one.source.sha256 != other.source.sha256:
            digests = {"found": other.source.sha256[:12], "expected": one.source.sha256[:12]}
            raise VolprepError("VP6013", path=found.spec_of(other.name).path, package=manifest.name, **digests)


def _plan(draft: ComparingDraft, imported: Imported, manifest: Manifest, found: Judge, progress: Progress) -> Plan:
    """Make the plan of the scene, with the choices that trying has made."""
    plan = plan_draft(draft, imported.scene, found.profile, progress, imported.measured, tried=found.forms)
    noted = iter(found.levels)
    return plan.model_copy(update={"channels": tuple(_chosen(channel, manifest, noted) for channel in plan.channels)})


def _chosen(plan: ChannelPlan, manifest: Manifest, noted: Iterator[str]) -> ChannelPlan:
    """Replace "auto" by the filter that made each level: as noted, in the order of channels and levels, or as named."""
    named = {
        level.index: level.filter
        for channel in manifest.channels
        if channel.name == plan.channel
        for level in channel.levels
    }
    levels: list[LevelPlan] = []
    for level in plan.levels:
        chosen = next(noted, named.get(level.index, "auto")) if level.index else level.filter
        made_by = level.filter if level.filter != "auto" or chosen == "none" else chosen
        levels.append(level.model_copy(update={"filter": made_by}))
    return plan.model_copy(update={"levels": tuple(levels)})
