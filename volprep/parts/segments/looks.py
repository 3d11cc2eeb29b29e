"""How the segments of a scan look: names, styles and tints, from what the source says and the scene wants."""

import re
import unicodedata
from collections.abc import Sequence

import numpy as np

from volprep.scan.segments.record import FoundSegment, FoundSegments, srgb_of
from volprep.scene.segments import SegmentsSettings, SegmentStyle
from volprep_formats.arrays import Float64Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.label_tables.table import made_colour
from volprep_formats.package.parts.segments.record import Segment, SegmentCode, SegmentLabel, Segments, looks
from volprep_formats.srgb import linear_of_srgb

_LONGEST_NAME = 60
_LONGEST_TITLE = 200


def segments_of(
    found: FoundSegments, wanted: SegmentsSettings, transfers: Sequence[str], scene: str
) -> tuple[Segments, tuple[int, ...]]:
    """Return the segments as the manifest has them, and for each label of the import its number there.

    Raises VP3222 for a style of a segment that is not there, VP3223 for a transfer function that is not.
    """
    inside, outside = wanted.inside or transfers[-1], wanted.outside or transfers[0]
    for name in (inside, outside, *(style.transfer for style in wanted.style if style.transfer)):
        if name not in transfers:
            raise VolprepError("VP3223", path=scene, name=name, known=", ".join(transfers))
    styles = _styles(found, wanted.style, scene)
    names = _names(found.segments, free=wanted.names == "free")
    segments = tuple(
        _segment(segment, style, name, inside, free=wanted.names == "free")
        for segment, style, name in zip(found.segments, styles, names, strict=True)
    )
    of_label = [outside if not members else segments[members[0]].transfer for members in found.members]
    # Labels of one transfer function stand next to each other, so that a shader tells them by comparing numbers.
    order = sorted(range(len(of_label)), key=lambda label: (transfers.index(of_label[label]), label))
    labels = tuple(
        SegmentLabel(segments=tuple(segments[member].name for member in found.members[label]), transfer=of_label[label])
        for label in order
    )
    transfers_shown = tuple(dict.fromkeys(label.transfer for label in labels))
    record = Segments(
        transfers=transfers_shown,
        border=wanted.border,
        # A segment without a voxel has no label: the package may lack the function of its style.
        segments=tuple(
            segment if segment.transfer in transfers_shown else segment.model_copy(update={"transfer": outside})
            for segment in segments
        ),
        labels=labels,
        outside=wanted.outside_opacity,
        sha256=found.sha256,
    )
    return record, tuple(order.index(label) for label in range(len(order)))


def style_looks(record: Segments) -> Float64Array:
    """Return tint times opacity factor, and opacity factor, of each label [style, label, 4]; 0 in other styles.

    Hidden segments count as visible, because an app may show them.
    """
    shown = record.model_copy(
        update={"segments": tuple(segment.model_copy(update={"visible": True}) for segment in record.segments)}
    )
    of_label = np.array(looks(shown))
    of_label[:, :3] *= of_label[:, 3:]
    of_style = np.equal.outer(record.transfers, [label.transfer for label in record.labels])
    result: Float64Array = of_label * of_style[..., None]
    return result


def _segment(found: FoundSegment, style: SegmentStyle, name: str, inside: str, *, free: bool) -> Segment:
    code = found.code if found.code is not None and found.code.public else None
    title = code.meaning if code is not None else found.public or (_printable(found.name) if free else "")
    colour = srgb_of(style.tint) if style.tint else found.colour or srgb_of(made_colour(found.number))
    red, green, blue = (linear_of_srgb(part) for part in colour)
    return Segment(
        name=name,
        title=title[:_LONGEST_TITLE] if title else None,
        code=None if code is None else SegmentCode(scheme=code.scheme, value=code.value, meaning=code.meaning),
        number=found.number,
        transfer=style.transfer or inside,
        tint=(red, green, blue),
        opacity=style.opacity,
        visible=style.visible,
        volume_ml=found.volume_ml,
    )


def _printable(name: str) -> str:
    """Return a typed name in one line, without control characters and marks of direction."""
    return "".join(filter(str.isprintable, " ".join(name.split())))


def _styles(found: FoundSegments, styles: Sequence[SegmentStyle], scene: str) -> list[SegmentStyle]:
    """Return the style of each segment. Raises VP3222 for a label that no segment has."""
    chosen = [SegmentStyle() for _ in found.segments]
    for style in styles:
        places = list(range(len(chosen)))
        if style.labels:
            known = [_known_as(segment) for segment in found.segments]
            missing = [label for label in style.labels if not any(_key(label) in names for names in known)]
            if missing:
                shown = ", ".join(sorted({str(segment.number) for segment in found.segments})[:20])
                raise VolprepError("VP3222", path=scene, label=missing[0], numbers=shown)
            wanted = {_key(label) for label in style.labels}
            places = [place for place, names in enumerate(known) if names & wanted]
        for place in places:
            chosen[place] = style
    return chosen


def _known_as(segment: FoundSegment) -> set[str]:
    """Return the numbers, names and codes that a scene may use for a segment."""
    names = {str(segment.number), segment.name.lower(), segment.public.lower()}
    if segment.code is not None:
        names |= {f"{segment.code.scheme}:{segment.code.value}".lower(), segment.code.meaning.lower()}
    return names - {""}


def _key(label: int | str) -> str:
    return str(label).lower()


def _names(segments: Sequence[FoundSegment], *, free: bool) -> list[str]:
    """Return a name for each segment: of its code, else of its free name if that is allowed, else its number."""
    names: list[str] = []
    for segment in segments:
        coded = segment.code.meaning if segment.code is not None and segment.code.public else ""
        text = coded or segment.public or (segment.name if free else "")
        # Letters with marks, such as umlauts, lose the marks.
        letters = re.sub(r"[\u0300-\u036f]", "", unicodedata.normalize("NFKD", text.casefold()))
        plain = re.sub(r"[^a-z0-9]+", "-", letters).strip("-")[:_LONGEST_NAME] or f"segment-{segment.number}"
        suffix = f"-{segment.number}" if plain in names else ""
        names.append(f"{plain[: _LONGEST_NAME - len(suffix)]}{suffix}")
    return names
