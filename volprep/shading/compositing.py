"""Compositing in shaders: the file glsl/compositing/NAME.glsl of each compositing, and its constants."""

from volprep.shading.compose import Slot, literal
from volprep.shading.feature import Feature
from volprep.shading.walk import Walk
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.program import CompositingName, ProgramDesign, RaySampling
from volprep_formats.package.transfer_function import TransferFunction

SURFACES: frozenset[CompositingName] = frozenset(("first-hit", "isosurface"))
"""Both ends of each segment are sampled, and rays end at the surface."""
CELL_BY_CELL: frozenset[CompositingName] = frozenset(("maximum", "minimum"))
"""Rays go from one face of a cell between eight voxels to the next, and know the field in between."""
_SAMPLE = "start + stride * i"
_SHOWN: dict[CompositingName, dict[str, str]] = {
    "maximum": {"SHOWN": "classify(greatest)", "HAS_GREATEST": "count > 0.0"},
    "first-hit": {"SHOWN": "classify(shown_value)"},
}
"""Colour and extinction of the only value of a ray."""
_PLACED: dict[CompositingName, dict[str, str]] = {
    "maximum": {
        "SHOWN": "classify_at(start + stride * greatest_at, greatest)",
        # Nearer to the least value than to what hidden voxels count as.
        "HAS_GREATEST": "count > 0.0 && greatest > 0.5 * HIDDEN",
    },
    "first-hit": {"SHOWN": "classify_at(hit, shown_value)"},
}
"""The same where it depends on the place: on the labels around it."""
_GOING = {"ray": " && transmittance >= least_transmittance", "surface": " && passed <= 0.0"}
"""How long a loop goes on, where rays may end early, and where they end at a surface: until what `stop` says."""
_SIDES: dict[CompositingName, str] = {
    "first-hit": ", true",
    "isosurface": ", stored_value(start + stride * (passed - 0.5)) < ISOVALUE",
}
"""Whether the value on the viewer's side of a surface is below the isovalue, as an argument."""

_CELLS: dict[str, Slot] = {
    "cells": "ray/cells:declared",
    "classification_start": "ray/cells:start",
    "face": "ray/cells:face",
    "passed": "ray/cells:passed",
    "enter": "ray/cells:enter",
    "cubic": "compositing/cubic:greatest",
    "sampled": "compositing/cubic:sampled",
}
"""Parts of rays that go from cell to cell."""


def compositing(
    manifest: Manifest, program: ProgramDesign, rays: RaySampling, walk: Walk, *, ends_early: bool
) -> Feature:
    """Return the parts of a compositing: the file of its name, with three sections for rays that may end early."""
    segments = manifest.segments if manifest.segments and manifest.segments.name == program.transfer else None
    # The transfer functions of segments have one isovalue and one reference length.
    name = segments.transfers[0] if segments else program.transfer
    function = next((function for function in manifest.transfer_functions if function.name == name), None)
    reference_mm = literal(1.0 if function is None else function.reference_mm)
    shown = _PLACED if segments else _SHOWN
    offers = {"REFERENCE_MM": reference_mm, "LIT_AT": _SAMPLE, "SIDE": "", **shown.get(program.compositing, {})}
    glsl = walk.compositing or f"compositing/{program.compositing.replace('-', '_')}"
    slots: dict[str, Slot] = {
        "about": f"{glsl}:about",
        "compositing_start": f"{glsl}:start",
        "sample": f"{glsl}:sample",
        "picture": f"{glsl}:picture",
    }
    if program.compositing in SURFACES:
        # Only light and labels ask for the place of a surface, not just its segment.
        slots |= _surface(glsl, is_placed=program.lighting != "none" or segments is not None)
        words = {"ISOVALUE": literal(_stored(manifest, function))}
        return Feature(
            slots, words, {**offers, "LIT_AT": "hit", "SIDE": _SIDES[program.compositing], "GOING": _GOING["surface"]}
        )
    if program.compositing in CELL_BY_CELL:
        slots |= _CELLS
        if segments:
            slots |= {
                part: f"{glsl}:{name}_placed" for part, name in (("compositing_start", "start"), ("sample", "sample"))
            }
    if program.compositing == "mida":
        return Feature(slots, _intensity_words(manifest, function), offers)
    if rays.opacity_cutoff is None or not ends_early or not walk.loops:
        return Feature(slots, offers=offers)
    words = {
        "LEAST_TRANSMITTANCE": literal(1.0 - rays.opacity_cutoff),
        "NOMINAL_STEP_MM": literal(rays.step_of(min(program.levels))),
    }
    # A technique with a compositing of its own ends rays as the other one does.
    ends = f"compositing/{program.compositing.replace('-', '_')}"
    slots |= {name: f"{ends}:{name}" for name in ("stop_start", "stop", "stop_picture")}
    return Feature(slots, words, {**offers, "GOING": _GOING["ray"]})


def _surface(glsl: str, *, is_placed: bool) -> dict[str, Slot]:
    """Return the parts of rays that end at a surface; `is_placed` if its place in a segment is looked for."""
    return {
        "stop": f"{glsl}:stop",
        "touch": "compositing/refinement:touch",
        "refinement": "compositing/refinement:between" if is_placed else None,
        "hit": f"{glsl}:hit" if is_placed else None,
        "classification_start": "compositing/refinement:start",
        "restart": "compositing/refinement:restart",
    }


def _intensity_words(manifest: Manifest, function: TransferFunction | None) -> dict[str, str]:
    """Return the feature that turns normalised stored values into intensities."""
    if manifest.quantization is None or function is None:
        msg = "intensities need codes"
        raise ValueError(msg)
    (low, high), (none, full) = manifest.quantization.window, function.intensity_range
    return {
        "INTENSITY_SCALE": literal((high - low) / (full - none)),
        "INTENSITY_OFFSET": literal((low - none) / (full - none)),
    }


def _stored(manifest: Manifest, function: TransferFunction | None) -> float:
    """Return the normalised stored value of an isovalue."""
    if manifest.quantization is None or function is None or function.isovalue is None:
        msg = "a surface needs codes and an isovalue"
        raise ValueError(msg)
    low, high = manifest.quantization.window
    return (function.isovalue - low) / (high - low)
