"""Shaders that put a small picture of the volume between lines (Moser and Weiskopf 2008, section 4)."""

from volprep.shading.compose import Dialect, Slot, compose
from volprep_formats.package.parts.hybrid.record import OverlayName


def overlay_texts(name: OverlayName, dialect: Dialect) -> tuple[str, str]:
    """Return the texts of its vertex and its fragment shader."""
    slots: dict[str, Slot] = {"dialect": f"ray/dialect_{dialect}"}
    return compose(f"overlay/{name}_vertex", dialect, {}, {}), compose(f"overlay/{name}", dialect, slots, {})
