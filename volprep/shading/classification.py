"""How a shader turns what it samples into colour and extinction: one way for each kind of classification.

All give the same words to the loop of the ray caster, so that any of them goes with any way of sampling.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from volprep.shading.compose import Slot, literal
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.palette import Palette
from volprep_formats.package.program import ClassificationName, Program, Sampler
from volprep_formats.package.texture import Texture


@dataclass(frozen=True)
class Classification:
    """Parts of the shader, and what they read."""

    parts: Mapping[str, Slot]
    """Files of the slots `classification`, `first` (before the loop) and `medium` (in it)."""
    constants: Mapping[str, str]
    """Words that these files use."""
    samplers: tuple[Sampler, ...]
    """Samplers that these files declare."""


def classification_of(manifest: Manifest, program: Program) -> Classification:
    """Return what belongs to a program of a package."""
    return classification(program.classification, program.transfer, manifest.textures, manifest.palettes)


def classification(
    name: ClassificationName, transfer: str, textures: tuple[Texture, ...], palettes: tuple[Palette, ...]
) -> Classification:
    """Return what belongs to a kind of classification and a transfer function."""
    if name == "palette":
        return _palette(next(palette for palette in palettes if palette.transfer == transfer))
    if name == "preclassified":
        return _preclassified(next(texture for texture in textures if texture.reference_mm is not None))
    role = "transfer" if name == "lookup" else name
    table = next(texture for texture in textures if texture.role == role and texture.transfer == transfer)
    return _WITH_TEXTURE[name](table)


def _lookup(table: Texture) -> Classification:
    return Classification(
        parts={"classification": f"classify_{_form(table)}", "first": None, "medium": "medium_sample"},
        constants={"OF": "", **_words(table)},
        samplers=(Sampler(name="u_transfer", role="transfer"),),
    )


def _preintegrated(table: Texture) -> Classification:
    return Classification(
        parts={
            "classification": f"classify_segment_{_form(table)}",
            "first": "first_segment",
            "medium": "medium_segment",
        },
        constants=_words(table),
        samplers=(Sampler(name="u_preintegrated", role="preintegrated"),),
    )


def _palette(palette: Palette) -> Classification:
    entries = [literal(*entry.colour, entry.extinction_per_mm) for entry in palette.entries]
    return Classification(
        parts={"classification": "classify_palette", "first": None, "medium": "medium_sample"},
        constants={
            "OF": "",
            "ENTRIES": str(len(entries)),
            "LAST_ENTRY": literal(len(entries) - 1),
            "PALETTE": ",\n  ".join(entries),
        },
        samplers=(),
    )


def _preclassified(volume: Texture) -> Classification:
    return Classification(
        parts={"classification": "classify_preclassified", "first": None, "medium": "medium_preclassified"},
        constants={"REFERENCE_MM": literal(volume.reference_mm or 0.0)},
        samplers=(),
    )


_WITH_TEXTURE: dict[str, Callable[[Texture], Classification]] = {"lookup": _lookup, "preintegrated": _preintegrated}


def _form(table: Texture) -> str:
    return "rgba16f" if table.gl.type == "HALF_FLOAT" else "rgba8"


def _words(table: Texture) -> dict[str, str]:
    """Constants that map a normalised stored value to the centre of its entry, and the scale of extinction."""
    entries = table.shape_zyx[2]
    words = {"LOOKUP_SCALE": literal((entries - 1) / entries), "LOOKUP_OFFSET": literal(0.5 / entries)}
    if table.max_extinction_per_mm is not None:
        words["MAX_EXTINCTION_PER_MM"] = literal(table.max_extinction_per_mm)
    return words
