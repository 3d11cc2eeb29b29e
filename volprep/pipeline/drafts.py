"""Drafts: begun by importing a source, carried on stage by stage, and finished by seal."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from volprep.parts.work import SCENE, generator, is_current, scene_bytes
from volprep.scan.channels import opened_channel
from volprep.scan.import_volume import NAME, NOT_MEASURED, import_key, import_volume
from volprep.scan.statistics import Measured
from volprep.scene.channels import (
    SceneChannel,
    drawn_channels,
    files_of,
    with_listed_channels,
)
from volprep.scene.request import Request, with_grey_ramp
from volprep.scene.scene import Scene
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.manifest import Channel, Manifest, SourceRecord, StageRecord
from volprep_formats.package.storage.draft import Draft
from volprep_formats.package.storage.files import MANIFEST
from volprep_formats.progress import Progress
from volprep_formats.source import SourceInfo

_NOT_IMPORTED = "0" * 64
# What later stages wrote into the manifest, as it is before they ran.
_BLANK: dict[str, object] = {
    "stored_type": None,
    "quantization": None,
    "levels": (),
    "transfer_functions": (),
    "palettes": (),
    "editing": None,
    "subvolumes": None,
    "render": None,
    "skipping": None,
    "proxy": None,
    "together": None,
    "compression": (),
    "plan": (),
}


@dataclass(frozen=True)
class Imported:
    """A draft whose source has been imported."""

    draft: Draft
    """The draft."""
    measured: tuple[Measured, ...] | None
    """What the import measured of each channel; None where an earlier one has done it."""


def import_draft(request: Request, folder: Path, progress: Progress) -> Imported:
    """Return the draft at `folder` with the source imported: a new one, or the old one if the source is unchanged.

    Raises what the readers raise, VP1090 for voxels that are no numbers, VP4006 for a sealed package, VP4020 and
    VP4023 where the draft cannot be written.
    """
    scene = with_listed_channels(request.scene)
    for path in files_of(scene.source):
        if not path.exists():
            raise VolprepError("VP1001", path=path)
    channels = drawn_channels(scene)
    key = import_key([channel.spec for channel in channels], generator())
    old = Draft.open(folder) if (folder / MANIFEST).exists() else None
    if old is not None and is_current(NAME, key, old.manifest):
        return Imported(old, None)
    draft: Draft | None = old
    found: list[tuple[SourceRecord, Measured]] = []
    for channel in channels:
        first = (channels[0].name, found[0][0].info.grid) if found else None
        with opened_channel(channel.name, channel.spec, first, progress) as source:
            info = source.info if first is None else source.info.model_copy(update={"grid": first[1]})
            draft = draft or Draft.create(folder, _new_manifest(request, info))
            measured = import_volume(draft, source, progress, channel.name if len(channels) > 1 else None)
            found.append((SourceRecord(info=info, sha256=measured.sha256), measured))
    assert draft is not None  # noqa: S101 - a scene has at least one channel
    record, statistics = found[0][0], found[0][1].statistics
    if request.scene_path is None:
        scene = with_grey_ramp(scene, statistics, record.info.grid)
    draft.write(SCENE, "work", scene_bytes(scene))
    changes: dict[str, object] = {"name": scene.name, "generator": generator(), "profile": request.profile, **_BLANK}
    changes |= {"source": record, "statistics": statistics, "channels": _listed(channels, found)}
    draft.commit(StageRecord(name=NAME, key=key), **changes)
    return Imported(draft, tuple(measured for _, measured in found))


def _new_manifest(request: Request, info: SourceInfo) -> Manifest:
    return Manifest(
        state="draft",
        name=request.scene.name,
        generator=generator(),
        profile=request.profile,
        source=SourceRecord(info=info, sha256=_NOT_IMPORTED),
        statistics=NOT_MEASURED,
    )


def _listed(
    channels: tuple[SceneChannel, ...], found: list[tuple[SourceRecord, Measured]]
) -> tuple[Channel, ...] | None:
    """Return the channels as the manifest lists them: not at all if there is one."""
    if len(channels) == 1:
        return None
    return tuple(
        Channel(
            name=channel.name,
            source=record,
            statistics=measured.statistics,
            transfers=tuple(transfer.name for transfer in channel.transfer),
        )
        for channel, (record, measured) in zip(channels, found, strict=True)
    )


def scene_of(draft: Draft) -> Scene:
    """Return the scene that a draft is made for; where the source is only its origin says."""
    return Scene.model_validate_json(draft.read_bytes(SCENE))


def imported_scene(request: Request, draft: Draft) -> Scene:
    """Return the scene of a request; the import gave a scan without a scene its transfer function."""
    if request.scene_path is not None:
        return request.scene
    return scene_of(draft).model_copy(update={"source": request.scene.source})


def run_verb(folder: Path, name: str, change: Callable[[Scene], Scene], progress: Progress) -> Draft:
    """Run one stage on the draft at `folder`, after `change` has changed what the user wants.

    Raises VP4001 to VP4006 for what is no draft, VP3023 and VP4040 if the stage is not needed or its inputs are
    missing, and what the stage raises.
    """
    # Here, because import needs no stage: they took half of the time that it needed to start.
    from volprep.pipeline.stages import STAGES, plan_draft, require_inputs, run_stage  # noqa: PLC0415

    draft = Draft.open(folder)
    scene = change(scene_of(draft))
    plan = plan_draft(draft, scene, draft.manifest.profile, progress=progress)
    stage = next(stage for stage in STAGES if stage.name == name)
    require_inputs(draft, stage, plan)
    run_stage(draft, stage, plan, scene, progress)
    if draft.manifest.state == "sealed":
        require_sound(folder)
    return draft


def require_sound(package: Path) -> None:
    """Raise VP4042 if what was built does not pass the check that every reader of packages may make."""
    from volprep_formats.package.check import check  # noqa: PLC0415 - as above

    findings = check(package)
    if findings:
        raise VolprepError("VP4042", finding=f"{findings[0].code} {findings[0].summary}")
