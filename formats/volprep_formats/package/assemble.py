"""Assemble a manifest from the parts of all stages. Dropping or repeating a stage changes only its own part."""

from collections.abc import Iterable, Sequence
from typing import Literal, TypeVar

from volprep_formats.package.channel import Channel, ChannelPart
from volprep_formats.package.manifest import Contribution, FileRecord, Heading, Manifest, PartRecords, StageRecord
from volprep_formats.package.pictures import with_drawings
from volprep_formats.record import Record

_Part = TypeVar("_Part", bound=Record)


def assembled(
    heading: Heading, stages: Sequence[StageRecord], files: Iterable[FileRecord], state: Literal["draft", "sealed"]
) -> Manifest:
    """Return the manifest after `stages` have run, in their order.

    Within a stage the package comes before its channels, so that the entries shared by several channels come first.
    """
    made = [contribution for stage in stages for contribution in stage.made]
    parts = {name: _gathered(made, name) for name in PartRecords.model_fields}
    composed = [program for one in made for program in one.programs]
    fidelity = [fidelity for one in made for fidelity in one.fidelity]
    parts["textures"] = tuple(
        sorted((texture for one in made for texture in one.textures), key=lambda texture: texture.name)
    )
    manifest = Manifest(
        **{name: getattr(heading, name) for name in Heading.model_fields},
        **parts,
        programs=tuple(program.program for program in composed),
        state=state,
        channels=_channels([contribution.channel for contribution in made if contribution.channel is not None]),
        stages=tuple(stages) if state == "draft" else (),
        files=tuple(sorted(files, key=lambda record: record.path)),
    )
    previews = {(one.channel.name, level) for one in made if one.channel is not None for level in one.previews}
    frames = [frame for one in made for frame in one.later_frames]
    return manifest.model_copy(update={"pictures": with_drawings(manifest, composed, fidelity, previews, frames)})


def _gathered(made: Sequence[Contribution], name: str) -> object:
    """Return one field of all contributions: lists one after the other, records joined, of all else the first."""
    values = [getattr(contribution, name) for contribution in made]
    if isinstance(PartRecords.model_fields[name].default, tuple):
        return tuple(entry for value in values for entry in value)
    found = [value for value in values if value is not None]
    return joined(found) if all(isinstance(value, Record) for value in found) else found[0]


def joined(parts: Iterable[_Part | None]) -> _Part | None:
    """Merge several records: concatenate lists; of all other fields take the first value that is not the default.

    Returns None for an empty sequence.
    """
    found = [part for part in parts if part is not None]
    if not found:
        return None
    fields: dict[str, object] = {}
    for name, field in type(found[0]).model_fields.items():
        values = [getattr(part, name) for part in found]
        if isinstance(values[0], tuple) and all(isinstance(record, Record) for value in values for record in value):
            fields[name] = tuple(record for value in values for record in value)
        else:
            fields[name] = next((value for value in values if value != field.default), values[0])
    return type(found[0])(**fields)


def _channels(parts: Sequence[ChannelPart]) -> tuple[Channel, ...]:
    names = dict.fromkeys(part.name for part in parts)
    each = [joined(part for part in parts if part.name == name) for name in names]
    return tuple(Channel.model_validate(dict(part)) for part in each if part is not None)
