"""volprep study: measurements beyond the verdict of a package."""

from collections.abc import Callable
from importlib import import_module

STUDIES = ("curves", "ablation", "stress", "walk", "progressive")
"""Names of the studies, and of their modules and functions."""


def study() -> None:
    """Measure beyond the verdict: curves of choices, worth of items, hard cases, a walk, pictures frame by frame."""


def commands() -> dict[str, Callable[..., None]]:
    """Return the function of each study, by name."""
    return {name: getattr(import_module(f"volprep_cli.studies.{name}"), name) for name in STUDIES}
