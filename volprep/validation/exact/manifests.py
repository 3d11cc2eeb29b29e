"""Compare two manifests field by field: the one under test, and the one that follows from scene and scan."""

import math
from collections.abc import Iterator, Sequence

from volprep_formats.package.manifest import Manifest, PlanItem

_ROUNDING = 1e-9
"""Relative difference of numbers that two machines may compute differently."""
_NAMES = ("name", "texture", "transfer", "index", "level", "kind", "file", "channel")
"""Fields that identify an entry of a list, for messages."""
_CHOSEN = "filter of level"
"""Items of the plan on a filter that was chosen by trying several."""
_MEASURED = ("RMSE", "random rays", "standard view")
"""Words that mark a reason as measured."""
_NOT_DERIVED = {"generator", "state", "stages", "files", "preview", "plan"}
"""Fields for the writer of the package, its files, and reasons: other checks cover them."""


def manifest_differences(found: Manifest, derived: Manifest) -> list[str]:
    """Return the differences of the manifest `found` from `derived`, a sentence for each field."""
    exclude = _NOT_DERIVED
    one, other = (manifest.model_dump(mode="json", exclude=exclude) for manifest in (found, derived))
    # Seal measures it, which is the last stage and draws.
    for drawing in (drawing for picture in one["pictures"] for drawing in picture["drawings"]):
        drawing["fidelity"] = None
    return [*_differences(one, other, "")]


def plan_differences(found: Sequence[PlanItem], derived: Sequence[PlanItem]) -> Iterator[str]:
    """Return the differences of the plan `found` from `derived`, a sentence for each field.

    Two things are not compared: the item of a filter that was chosen by trying several, which is not tried again, and
    reasons with errors measured along rays, which the build measures on the finished levels.
    """
    one, other = ({(item.channel, item.name): item for item in plan} for plan in (found, derived))
    for key in [*other, *(key for key in one if key not in other)]:
        channel, name = key
        where = f"plan[{name}]" if channel is None else f"plan[{name} of {channel}]"
        if key not in one:
            yield f"{where} is not there, but follows from the scene"
        elif key not in other:
            if not name.startswith(_CHOSEN):
                yield f"{where} does not follow from the scene"
        else:
            yield from (f"{where}.{problem}" for problem in _item_differences(one[key], other[key]))


def _item_differences(found: PlanItem, derived: PlanItem) -> Iterator[str]:
    for field in sorted(PlanItem.model_fields.keys() - {"name", "channel", "reason", "size_bytes"}):
        if getattr(found, field) != getattr(derived, field):
            yield f"{field} is {getattr(found, field)}, {getattr(derived, field)} follows from the scene"
    if not derived.files and found.size_bytes != derived.size_bytes:
        yield f"size_bytes is {found.size_bytes}, {derived.size_bytes} follows from the scene"
    if found.reason != derived.reason and not any(word in derived.reason for word in _MEASURED):
        yield f"reason is {_shown(found.reason)}, {_shown(derived.reason)} follows from the scene"


def priced_differences(manifest: Manifest) -> Iterator[str]:
    """Return items of the plan whose size differs from that of their files."""
    sizes = {record.path: record.size_bytes for record in manifest.files}
    for item in manifest.plan:
        expected = sum(sizes.get(path, 0) for path in item.files)
        if item.files and item.size_bytes != expected:
            yield f"plan[{item.name}].size_bytes is {item.size_bytes}, its files have {expected}"


def _differences(found: object, derived: object, where: str) -> Iterator[str]:
    if isinstance(found, dict) and isinstance(derived, dict):
        for name in {**derived, **found}:
            yield from _differences(found.get(name), derived.get(name), f"{where}.{name}" if where else name)
    elif isinstance(found, list) and isinstance(derived, list):
        if len(found) != len(derived):
            yield f"{where} has {len(found)} entries, {len(derived)} follow from the scene"
            return
        for number, (one, other) in enumerate(zip(found, derived, strict=True)):
            yield from _differences(one, other, f"{where}[{_label(other, number)}]")
    elif not _is_same(found, derived):
        yield f"{where} is {_shown(found)}, {_shown(derived)} follows from the scene"


def _label(entry: object, number: int) -> str:
    if isinstance(entry, dict):
        return next((str(entry[name]) for name in _NAMES if entry.get(name) is not None), str(number))
    return str(number)


def _is_same(found: object, derived: object) -> bool:
    if isinstance(found, float) and isinstance(derived, float):
        return math.isclose(found, derived, rel_tol=_ROUNDING)
    return found == derived


def _shown(value: object) -> str:
    text = "nothing" if value is None else str(value)
    return text if len(text) <= 80 else f"{text[:77]}..."
