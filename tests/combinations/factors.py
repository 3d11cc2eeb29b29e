"""The factors of a scene, their values, and what the plan refuses. The first value of a factor is the default."""

from collections.abc import Mapping
from types import MappingProxyType

FACTORS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "medium": ("scan", "channels", "mixed", "crisp", "labels", "colour", "grids", "frames"),
        "compositing": (
            *("emission-absorption", "back-to-front", "maximum", "minimum", "average", "mida"),
            *("first-hit", "isosurface"),
        ),
        "lighting": ("none", "headlight", "phong", "blinn-phong"),
        "baked": ("none", "occlusion", "scattering", "shadow"),
        "classification": ("lookup", "auto", "preintegrated", "palette", "control-points", "preclassified"),
        "layout": ("plain", "bricks", "compressed", "mipmaps", "on-demand"),
        "levels": ("one", "several", "box", "maximum"),
        "pieces": ("none", "files", "single"),
        "mesh": ("none", "merged", "convex"),
        "clip": ("none", "plane", "aware"),
        "bits": ("auto", "8", "16"),
        "profile": ("gles3", "gles3-norm16", "gles3-astc", "gles2-2048", "gles2-4096", "gles1"),
    }
)

Row = dict[str, str]
"""A value for each factor."""

DEFAULTS: Row = {factor: values[0] for factor, values in FACTORS.items()}
_CHANGED = {factor: values[1:] for factor, values in FACTORS.items()}
_OF_ONE_SAMPLE = ("maximum", "minimum", "average", "mida")
_OF_VALUES = (*_OF_ONE_SAMPLE, "first-hit", "isosurface")
_SEGMENTS = ("mixed", "crisp")
_LAID_OVER = ("emission-absorption", "back-to-front")
_FLAT = ("gles2-2048", "gles2-4096")
"""Profiles without 3D textures and without textures of 16 bits."""

_TOGETHER = ("channels", "grids")

REFUSED: tuple[Mapping[str, tuple[str, ...]], ...] = (
    {"medium": (*_TOGETHER, "labels", "colour"), "compositing": _OF_VALUES},
    {"medium": (*_TOGETHER, "colour", "frames"), "baked": _CHANGED["baked"]},
    {"medium": _TOGETHER, "lighting": ("phong", "blinn-phong")},
    {"medium": (*_TOGETHER, "colour"), "classification": ("preclassified",)},
    {"medium": _TOGETHER, "classification": ("preintegrated",)},
    {"medium": _TOGETHER, "layout": ("bricks",)},
    {"medium": (*_TOGETHER, "frames"), "pieces": _CHANGED["pieces"]},
    {"medium": (*_TOGETHER, "colour", "frames", *_SEGMENTS), "profile": ("gles1",)},
    {"medium": _SEGMENTS, "compositing": ("minimum", "average", "mida", "isosurface")},
    {"medium": _SEGMENTS, "baked": _CHANGED["baked"]},
    {"medium": _SEGMENTS, "classification": ("preintegrated", "preclassified")},
    {"medium": _SEGMENTS, "layout": ("compressed", "mipmaps")},
    {"medium": _SEGMENTS, "pieces": ("single",)},
    {"medium": _SEGMENTS, "mesh": _CHANGED["mesh"]},
    {"medium": _SEGMENTS, "bits": ("16",), "pieces": ("files",)},
    {"medium": _SEGMENTS, "compositing": _LAID_OVER, "levels": ("maximum",)},
    {"medium": ("labels",), "baked": _CHANGED["baked"]},
    {"medium": ("labels",), "lighting": ("phong", "blinn-phong")},
    {"medium": ("labels",), "lighting": ("headlight",), "layout": ("bricks", "mipmaps")},
    {"medium": ("labels",), "lighting": ("headlight",), "classification": ("preclassified",)},
    {"medium": ("labels",), "classification": ("preintegrated", "palette")},
    {"medium": ("labels",), "bits": _CHANGED["bits"]},
    {"medium": ("labels",), "levels": ("box", "maximum")},
    {"medium": ("colour",), "compositing": ("back-to-front",)},
    {"medium": ("colour",), "lighting": _CHANGED["lighting"]},
    {"medium": ("colour",), "classification": _CHANGED["classification"]},
    {"medium": ("colour",), "layout": ("bricks", "mipmaps")},
    {"medium": ("colour",), "levels": ("maximum",)},
    {"medium": ("colour",), "pieces": _CHANGED["pieces"]},
    {"medium": ("colour",), "mesh": _CHANGED["mesh"]},
    {"medium": ("colour",), "bits": _CHANGED["bits"]},
    {"medium": ("grids",), "compositing": ("back-to-front",)},
    {"medium": ("grids",), "layout": ("compressed", "mipmaps")},
    {"medium": ("grids",), "profile": _FLAT},
    {"medium": ("frames",), "layout": ("bricks", "compressed", "mipmaps")},
    {"medium": ("frames",), "levels": ("maximum",)},
    {"medium": ("frames",), "mesh": _CHANGED["mesh"]},
    {"layout": ("on-demand",), "medium": _CHANGED["medium"]},
    {"layout": ("on-demand",), "compositing": _OF_VALUES},
    {"layout": ("on-demand",), "lighting": ("phong", "blinn-phong")},
    {"layout": ("on-demand",), "baked": _CHANGED["baked"]},
    {"layout": ("on-demand",), "classification": ("preclassified",)},
    {"layout": ("on-demand",), "pieces": _CHANGED["pieces"]},
    {"layout": ("on-demand",), "profile": (*_FLAT, "gles1")},
    {"compositing": _OF_ONE_SAMPLE, "lighting": _CHANGED["lighting"]},
    {"compositing": _OF_VALUES, "baked": _CHANGED["baked"]},
    {"compositing": _CHANGED["compositing"], "classification": ("preintegrated",)},
    {"compositing": _OF_VALUES, "classification": ("palette", "preclassified")},
    {"compositing": tuple(each for each in _OF_VALUES if each != "maximum"), "classification": ("control-points",)},
    {"compositing": tuple(each for each in _OF_VALUES if each != "maximum"), "levels": ("maximum",)},
    {"compositing": _LAID_OVER, "classification": ("control-points",), "levels": ("maximum",)},
    {"compositing": ("back-to-front",), "mesh": _CHANGED["mesh"]},
    {"baked": _CHANGED["baked"], "classification": ("preintegrated", "preclassified")},
    {"baked": _CHANGED["baked"], "layout": ("compressed",)},
    {"baked": _CHANGED["baked"], "levels": ("maximum",)},
    {"classification": ("preclassified",), "layout": ("bricks",)},
    {"classification": ("preclassified",), "pieces": _CHANGED["pieces"]},
    {"classification": ("preclassified", "palette"), "levels": ("maximum",)},
    {"classification": ("preclassified",), "lighting": _CHANGED["lighting"], "layout": ("mipmaps",)},
    {"classification": ("preclassified",), "mesh": _CHANGED["mesh"]},
    {"profile": _FLAT, "bits": ("16",)},
    {"profile": _FLAT, "layout": ("mipmaps",)},
    {"profile": _FLAT, "layout": ("bricks",), "baked": _CHANGED["baked"]},
    {"profile": ("gles1",), "lighting": _CHANGED["lighting"]},
    {"profile": ("gles1",), "baked": _CHANGED["baked"]},
    {"profile": ("gles1",), "classification": tuple(each for each in _CHANGED["classification"] if each != "auto")},
    {"profile": ("gles1",), "compositing": _OF_VALUES},
    {"profile": ("gles1",), "bits": ("16",)},
    {"profile": ("gles1",), "layout": ("bricks", "mipmaps")},
    {"profile": ("gles1",), "pieces": _CHANGED["pieces"]},
    {"profile": ("gles1",), "mesh": _CHANGED["mesh"]},
)
"""Values of two or three factors that the plan refuses together, with a code. No row of a covering array has them."""


def name_of(row: Row) -> str:
    """Return a row's name: its values that are not the defaults, in the order of the factors."""
    changed = [f"{factor}={row[factor]}" for factor in FACTORS if row[factor] != DEFAULTS[factor]]
    return "+".join(changed) or "defaults"


def row_of(name: str) -> Row:
    """Return the row of a name."""
    return DEFAULTS | dict(each.split("=") for each in name.split("+") if "=" in each)
