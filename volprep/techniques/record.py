"""The record of a technique: what plan, validation and tests ask of it."""

from dataclasses import dataclass

from volprep_formats.package.program import ClassificationName, CompositingName, Sampling, TechniqueName


@dataclass(frozen=True)
class Technique:
    """How a program goes through the volume."""

    name: TechniqueName
    """Name in scenes and programs."""
    text: str
    """Short description."""
    samplings: frozenset[Sampling]
    """Sources of the volume that it can read."""
    compositings: frozenset[CompositingName]
    """Compositings that it supports."""
    classifications: frozenset[ClassificationName]
    """How it can classify them."""
    loops: bool
    """Whether a fragment takes several samples, so that it may skip empty space and end early."""
    blends: bool = False
    """Whether the samples of a ray are layers that are blended, each rounded to the format of the picture."""
    meshes: bool = False
    """Whether its rays may begin and end at proxy geometry."""
    passes_before: int = 0
    """Passes that come before the picture, each of whose targets takes a texture unit."""
    order: float | None = None
    """Order of convergence as steps get finer, 0 for techniques that converge to another picture than that of the
    compositing, as they were published; if None, that of the compositing."""
    order_limit: str | None = None
    """Reason for the order, for people."""
    step_voxels: float | None = None
    """Distance of samples, in voxels, where the scene names none and no error can be measured, because the technique
    converges to another picture; None for the others."""
