"""A manifest put together from what each stage has added. To drop or repeat a stage changes its part and no other."""

from collections.abc import Iterable, Sequence
from typing import Literal, TypeVar

from volprep_formats.package.channel import Channel, ChannelPart
from volprep_formats.package.manifest import FileRecord, Heading, Manifest, StageRecord
from volprep_formats.record import Record

_Part = TypeVar("_Part", bound=Record)


def assembled(
    heading: Heading, stages: Sequence[StageRecord], files: Iterable[FileRecord], state: Literal["draft", "sealed"]
) -> Manifest:
    """Return the manifest after `stages` have run, in their order.

    Within a stage the package comes before its channels, so that what is drawn of several comes first.
    """
    made = [contribution for stage in stages for contribution in stage.made]
    textures = [texture for each in made for texture in each.textures]
    return Manifest(
        **{name: getattr(heading, name) for name in Heading.model_fields},
        state=state,
        channels=_channels([each.channel for each in made if each.channel is not None]),
        textures=tuple(sorted(textures, key=lambda texture: texture.name)),
        palettes=tuple(palette for each in made for palette in each.palettes),
        skipping=joined(each.skipping for each in made),
        programs=tuple(program for each in made for program in each.programs),
        editing=joined(each.editing for each in made),
        subvolumes=joined(each.subvolumes for each in made),
        proxy=joined(each.proxy for each in made),
        fidelity=tuple(fidelity for each in made for fidelity in each.fidelity),
        costs=tuple(cost for each in made for cost in each.costs),
        preview=next((each.preview for each in made if each.preview is not None), None),
        stages=tuple(stages) if state == "draft" else (),
        files=tuple(sorted(files, key=lambda record: record.path)),
    )


def joined(parts: Iterable[_Part | None]) -> _Part | None:
    """Return one record of what several say: lists one after the other, of all else the first that is not the default.

    None if there are none.
    """
    found = [part for part in parts if part is not None]
    if not found:
        return None
    fields: dict[str, object] = {}
    for name, field in type(found[0]).model_fields.items():
        values = [getattr(part, name) for part in found]
        if isinstance(values[0], tuple) and all(isinstance(each, Record) for value in values for each in value):
            fields[name] = tuple(each for value in values for each in value)
        else:
            fields[name] = next((value for value in values if value != field.default), values[0])
    return type(found[0])(**fields)


def _channels(parts: Sequence[ChannelPart]) -> tuple[Channel, ...]:
    names = dict.fromkeys(part.name for part in parts)
    each = [joined(part for part in parts if part.name == name) for name in names]
    return tuple(Channel.model_validate(dict(part)) for part in each if part is not None)
