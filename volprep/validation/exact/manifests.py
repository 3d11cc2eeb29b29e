"""Two manifests compared field by field: the one on trial, and the one that follows from scene and scan."""

import math
from collections.abc import Iterator

from volprep_formats.package.manifest import Manifest
from volprep_formats.package.parts.costs.count import draw_costs

_ROUNDING = 1e-9
"""Relative difference of numbers that two machines may compute differently."""
_NAMES = ("name", "texture", "transfer", "index", "kind", "file", "channel")
"""Fields by which entries of a list are told apart, for messages."""
_NOT_DERIVED = {"generator", "state", "stages", "files", "preview", "plan", "fidelity"}
"""Fields that say who wrote the package, what its files are, and why: other checks are for them."""


def manifest_differences(found: Manifest, derived: Manifest) -> list[str]:
    """Return what the manifest `found` says otherwise than `derived`, a sentence for each field."""
    exclude = _NOT_DERIVED
    # Seal adds them, which is the last stage and draws.
    derived = derived.model_copy(update={"costs": draw_costs(derived)})
    one, other = (each.model_dump(mode="json", exclude=exclude) for each in (found, derived))
    return [*_differences(one, other, "")]


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
