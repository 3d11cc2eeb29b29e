"""Transfer functions that come with volprep, one TOML file each.

The numbers are our own. Those for CT are Hounsfield units and millimetres; those for scans without a unit are places in
the measured range, with opacity for a part of the scan's diagonal.
"""

import tomllib
from collections.abc import Mapping
from functools import cache
from importlib.resources import files

from pydantic import Field, model_validator

from volprep.scene.points import TransferWish
from volprep_formats.label_tables.table import made_colour
from volprep_formats.package.transfer_function import Fraction

PRESET_LABELS = 255
"""Labels that the preset "labels" has colours for."""


class Preset(TransferWish):
    """A transfer function for a kind of scan."""

    shows: str
    """Description, in a line."""
    lit: bool = False
    """Whether it looks flat without light."""
    lighting: Mapping[str, object] = Field(default_factory=dict)
    """Settings of [lighting] that a scene takes which says nothing of `lighting.baked`."""
    label_colours: tuple[str, ...] = ()
    """For labels, which have no points of their own: "#rrggbb" of labels 1, 2 and so on; the others are made."""
    label_opacity: Fraction = 0.0
    """Opacity of every label."""

    @property
    def in_hounsfield_units(self) -> bool:
        """Whether it is for a CT."""
        return self.values == "physical" and not self.label_colours

    @model_validator(mode="before")
    @classmethod
    def _gives_points_to_labels(cls, data: object) -> object:
        if isinstance(data, dict) and data.get("label_colours"):
            return {**data, "points": _label_points(data["label_colours"], data["label_opacity"])}
        return data


def _label_points(first: list[str], opacity: float) -> list[dict[str, object]]:
    """Return two points for each label, which owns the values from half below it to half above."""
    points: list[dict[str, object]] = [{"value": 0.5, "colour": first[0], "opacity": 0.0}]
    for label in range(1, PRESET_LABELS + 1):
        colour = first[label - 1] if label <= len(first) else made_colour(label)
        points += [{"value": label + side, "colour": colour, "opacity": opacity} for side in (-0.5, 0.5)]
    return points


def preset_names() -> tuple[str, ...]:
    """Names of the presets, in order."""
    folder = files(__name__)
    return tuple(sorted(path.name.removesuffix(".toml") for path in folder.iterdir() if path.name.endswith(".toml")))


@cache
def load_preset(name: str) -> Preset:
    """Read a preset. Raises ValueError, listing the valid names, for an unknown name."""
    if name not in preset_names():
        msg = f"preset: there is no {name}, only {', '.join(preset_names())}"
        raise ValueError(msg)
    return Preset.model_validate(_settings(name))


def _settings(name: str) -> dict[str, object]:
    """Return the settings of a preset's file; missing ones come from the preset that it is `like`."""
    own = tomllib.loads((files(__name__) / f"{name}.toml").read_text(encoding="utf-8"))
    like = own.pop("like", None)
    return own if like is None else {**_settings(like), **own}
