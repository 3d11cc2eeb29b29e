"""How a shader turns samples into colour and extinction: one way for each kind of classification.

All give the loop of the ray caster one expression, so that each works with every way of sampling.
"""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np

from volprep.shading.compose import Dialect, Instance, literal
from volprep.shading.feature import Feature
from volprep_formats.package.integral_table import LEAST_ENTRIES
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.program import LAID_OVER, ClassificationName, CompositingName, Sampler, TechniqueName
from volprep_formats.package.texture import Texture

VOXELS = "classification/voxels"
"""Part that splits segments at the faces of voxels."""
_IN_THE_MIDDLE = "start + stride * i"


_THROUGH_VOXELS = {False: "start + stride * (i - 0.5), stride", True: "start + stride * (i + 0.5), -stride"}
"""Segment of the ray from the viewer's side on, by whether the ray runs towards the viewer."""


def splits_voxels(technique: TechniqueName, compositing: CompositingName, classification: ClassificationName) -> bool:
    """Return whether programs split the segments of a ray through labels at the faces of voxels."""
    return compositing in LAID_OVER and classification in _OF_SAMPLES and not technique.endswith("as-published")


def voxel_classification(
    manifest: Manifest, name: ClassificationName, transfer: str, dialect: Dialect, *, backwards: bool
) -> Feature:
    """Return how a program classifies labels, which are constant in their voxels: each segment is split at faces.

    The classification is one that classifies sample by sample.
    """
    function = sample_classification(manifest, name, transfer, "", dialect)
    return Feature(
        slots={"classification": VOXELS, "samples": function.slots["classification"], "classification_start": None},
        offers={"MEDIUM": f"classify_voxels({_THROUGH_VOXELS[backwards]})"},
        samplers=function.samplers,
    )


def lit_in_voxels(lit: Feature) -> Feature:
    """Return light from the viewer for labels: it is constant in their voxels, too."""
    slots = {
        "voxel_normals": lit.slots["lighting"],
        "voxel_direction": f"{VOXELS}:direction",
        "voxel_light": lit.slots["light"],
        **dict.fromkeys(("lighting", "lighting_start", "light")),
    }
    return replace(lit, slots={**lit.slots, **slots}, offers={**lit.offers, "NORMAL": "normal_at(middle)"})


def classification(manifest: Manifest, name: ClassificationName, transfer: str, dialect: Dialect) -> Feature:
    """Return how a program classifies with a transfer function. It offers MEDIUM, of the segment whose middle is i."""
    if name == "preclassified":
        return _preclassified(next(texture for texture in manifest.textures if texture.reference_mm is not None))
    if name == "preintegrated":
        return _preintegrated(_table(manifest, "preintegrated", transfer))
    function = sample_classification(manifest, name, transfer, "", dialect)
    return Feature(
        slots={"classification": function.slots["classification"], "classification_start": None},
        offers={"MEDIUM": f"classify(stored_value({_IN_THE_MIDDLE}))"},
        samplers=function.samplers,
    )


def sample_classification(
    manifest: Manifest, name: ClassificationName, transfer: str, suffix: str, dialect: Dialect
) -> Feature:
    """Return the function that classifies one stored value, with `suffix` behind its names.

    Raises ValueError for a kind that does not classify sample by sample.
    """
    if name not in _OF_SAMPLES:
        msg = f"{transfer} is not classified sample by sample"
        raise ValueError(msg)
    return _OF_SAMPLES[name](manifest, transfer, suffix, dialect)


def _lookup(manifest: Manifest, transfer: str, suffix: str, _dialect: Dialect) -> Feature:
    table = _table(manifest, "transfer", transfer)
    part = Instance(f"classification/lookup_{_form(table)}", {"OF": suffix, **_words(table)})
    return Feature({"classification": (part,)}, samplers=(Sampler(name=f"u_transfer{suffix}", role="transfer"),))


def _palette(manifest: Manifest, transfer: str, suffix: str, dialect: Dialect) -> Feature:
    entries = [literal(*entry.colour, entry.extinction_per_mm) for entry in manifest.palette_of[transfer].entries]
    words = {"OF": suffix, "ENTRIES": str(len(entries)), "LAST_ENTRY": literal(len(entries) - 1)}
    if dialect == "es300":
        words["PALETTE"] = ",\n  ".join(entries)
    else:
        words["FIRST"] = entries[0]
        others = enumerate(entries[1:], start=1)
        words["NEXT"] = "\n  ".join(f"medium = entry < {n - 0.5} ? medium : {entry};" for n, entry in others)
    return Feature({"classification": (Instance(f"classification/palette_{dialect}", words),)})


def _control_points(manifest: Manifest, transfer: str, suffix: str, _dialect: Dialect) -> Feature:
    function = next(function for function in manifest.transfer_functions if function.name == transfer)
    low, high = _window(manifest, transfer)
    places = [(point.value - low) / (high - low) for point in function.points]
    media = [np.array([*point.colour, point.extinction_per_mm], np.float32) for point in function.points]
    reached, lines = media[0], []
    for (below, at), medium in zip(pairwise(places), media[1:], strict=True):
        # From the totals of rounded sums, so that a weight that returns to 0 is exactly 0. A sum takes less time than
        # mixing: 7 to 10 % of a picture of a head (tests/benchmarks/bench_vtk.py).
        change = medium - reached
        reached = reached + change
        lines.append(f"medium += {literal(*change.tolist())} * {_share(below, at)};")
    words = {"OF": suffix, "FIRST": literal(*media[0].tolist()), "NEXT": "\n  ".join(lines)}
    return Feature({"classification": (Instance("classification/control_points", words),)})


def _share(below: float, at: float) -> str:
    """How far a value is from one control point to the next, as GLSL; at a jump it is on the side above."""
    if np.float32(below) == np.float32(at):
        return f"step({literal(at)}, stored)"
    return f"clamp((stored - {literal(below)}) * {literal(1 / (at - below))}, 0.0, 1.0)"


def _window(manifest: Manifest, transfer: str) -> tuple[float, float]:
    channel = next(channel for channel in manifest.channels if transfer in channel.transfers)
    if channel.quantization is None:
        msg = f"channel {channel.name} has no codes"
        raise ValueError(msg)
    return channel.quantization.window


_OF_SAMPLES: dict[ClassificationName, Callable[[Manifest, str, str, Dialect], Feature]] = {
    "lookup": _lookup,
    "palette": _palette,
    "control-points": _control_points,
}


def _preintegrated(table: Texture) -> Feature:
    part = "classification/preintegrated"
    entries = table.shape_zyx[2]
    low, high = table.stored_range or (0.0, 1.0)
    words = {
        # A sum that grows by its highest byte, by 2^-8 of the whole.
        "EXTINCTION_PER_MM": literal((table.max_extinction_per_mm or 0.0) * (entries - 1) / 256),
        "PER_ENTRY": literal(1 / entries),
        "ENTRIES_PER_VALUE": literal((entries - 1) / (high - low)),
        "FIRST_VALUE": literal(low),
        "LAST_SEGMENT": literal(entries - 2),
        "LEAST_ENTRIES": literal(LEAST_ENTRIES),
    }
    return Feature(
        slots={"classification": part, "classification_start": f"{part}:start"},
        words=words,
        offers={"MEDIUM": "classify(front, end_at(start + stride * (i + 0.5)))", "FRONT": "End", "FRONT_AT": "end_at"},
        samplers=(Sampler(name="u_preintegrated", role="preintegrated"),),
    )


def _preclassified(volume: Texture) -> Feature:
    return Feature(
        slots={"classification": "classification/preclassified", "classification_start": None},
        words={"REFERENCE_MM": literal(volume.reference_mm or 0.0)},
        offers={"MEDIUM": f"classify(voxel_texel({_IN_THE_MIDDLE}))"},
    )


def _table(manifest: Manifest, role: str, transfer: str) -> Texture:
    return next(texture for texture in manifest.textures if (texture.role, texture.transfer) == (role, transfer))


def _form(table: Texture) -> str:
    return "rgba16f" if table.format == "rgba16float" else "rgba8"


def _words(table: Texture) -> dict[str, str]:
    """Constants that map a normalised stored value to the centre of its entry, and the scale of extinction."""
    entries = table.shape_zyx[2]
    words = {"LOOKUP_SCALE": literal((entries - 1) / entries), "LOOKUP_OFFSET": literal(0.5 / entries)}
    if table.max_extinction_per_mm is not None:
        words["MAX_EXTINCTION_PER_MM"] = literal(table.max_extinction_per_mm)
    return words
