"""Add the later frames of a series to its package: those textures that no earlier frame has."""

from collections.abc import Iterator
from pathlib import PurePosixPath

from volprep.parts.registry import PARTS
from volprep.parts.stage import Stage, Work
from volprep.parts.work import frame_drafts
from volprep.plan.products import FramesPlan
from volprep.plan.records import Plan
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.manifest import Contribution
from volprep_formats.package.parts.skip.record import Skipping
from volprep_formats.package.picture import FrameTextures
from volprep_formats.package.storage.draft import Draft
from volprep_formats.package.texture import Texture
from volprep_formats.progress import Progress


def _run(draft: Draft, plan: Plan, progress: Progress) -> Contribution:
    progress.start("frames", len(plan.frames) - 1)
    first = {texture.name: texture for texture in draft.manifest.textures}
    held = {(texture.name, digest): texture.name for texture, digest in _digests(draft)}
    textures: list[Texture] = []
    frames: list[FrameTextures] = []
    for number, frame in enumerate(frame_drafts(draft), 1):
        instead: dict[str, str] = {}
        for texture, digest in _digests(frame):
            if first.get(texture.name) != texture:
                # All frames have the programs and drawings of the first one.
                raise VolprepError("VP4042", finding=f"frame {number} needs another texture {texture.name}")
            name = held.setdefault((texture.name, digest), f"{texture.name}-frame{number}")
            if name == f"{texture.name}-frame{number}":
                path = PurePosixPath(texture.file)
                file = f"{path.parent}/frame{number}/{path.name}"
                draft.write(file, "texture", frame.read_bytes(texture.file))
                textures.append(texture.model_copy(update={"name": name, "file": file}))
            if name != texture.name:
                instead[texture.name] = name
        frames.append(FrameTextures(instead=instead))
        progress.advance()
    return Contribution(
        textures=tuple(textures), later_frames=tuple(frames), skipping=_skipping(draft.manifest.skipping, frames)
    )


def _digests(draft: Draft) -> Iterator[tuple[Texture, str]]:
    digests = {record.path: record.sha256 for record in draft.manifest.files}
    yield from ((texture, digests[texture.file]) for texture in draft.manifest.textures)


def _skipping(first: Skipping | None, frames: list[FrameTextures]) -> Skipping | None:
    """Describe the skip tables of later frames, which are like the first frame's."""
    if first is None:
        return None
    names = [(name, other) for frame in frames for name, other in frame.instead.items()]
    tables = {
        other: table.model_copy(update={"texture": other})
        for table in first.tables
        for name, other in names
        if table.texture == name
    }
    return Skipping(epsilon=first.epsilon, tables=tuple(tables.values()))


STAGE = Stage(
    name=FramesPlan.STAGE,
    summary="Add the textures of later frames of a time series.",
    reads=tuple(stage.name for part in PARTS for stage in part.stages),
    package=Work(lambda plan: plan.frames, _run, shapes=None),
    each_frame=False,
    is_needed=lambda plan: bool(plan.frames),
)
