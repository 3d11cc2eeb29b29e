"""Transfer functions that come with volprep, one TOML file each.

The numbers are our own. Those for CT are Hounsfield units and millimetres; those for scans without a unit are places in
the measured range, with opacity for a part of the scan's diagonal.
"""

import tomllib
from functools import cache
from importlib.resources import files

from volprep.scene.points import TransferWish


class Preset(TransferWish):
    """A transfer function for a kind of scan."""

    shows: str
    """What it shows, in a line."""


def preset_names() -> tuple[str, ...]:
    """Names of the presets, in order."""
    folder = files(__name__)
    return tuple(sorted(each.name.removesuffix(".toml") for each in folder.iterdir() if each.name.endswith(".toml")))


@cache
def load_preset(name: str) -> Preset:
    """Read a preset. Raises ValueError, with the names that there are, for another name."""
    if name not in preset_names():
        msg = f"preset: there is no {name}, only {', '.join(preset_names())}"
        raise ValueError(msg)
    return Preset.model_validate(tomllib.loads((files(__name__) / f"{name}.toml").read_text(encoding="utf-8")))
