"""Label volumes: voxels are numbers of things, and no mixture of two may be seen.

A sample has the label of its voxel. Shaders split the segments of emission-absorption where a ray passes from voxel to
voxel. Elsewhere samples may miss the corner of a voxel, or count it a whole step too long: the opacity of one step is
what such a ray is off by, however fine the voxels are.
"""

import math
from collections.abc import Sequence

from volprep.parts.case import Case
from volprep.scan.relabelled import LARGEST_LABEL, MOST_LABELS
from volprep.scene.scene import SceneRender
from volprep.shading.classification import splits_voxels
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.function_table import Table
from volprep_formats.package.manifest import Tolerance
from volprep_formats.package.transfer_function import TransferFunction

_SHARE = 0.25
"""Part of the largest error allowed that one step through the densest label may make: rays meet several corners. With
a half, 1 of 9 views of thin labels was beyond it, with a quarter none (largest error 0.27 and 0.11 of 0.25)."""
_LONGEST_STEP_VOXELS = 0.5
_FINEST_STEP_VOXELS = 0.125
"""No finer step for labels so dense that only a step of nothing would do."""


def require_distinct_labels(case: Case) -> Case:
    """Return the channel.

    Raises VP3043 for a classification that gives labels colours of others, VP3286 for light that is not constant in
    voxels, or that falls on the numbers of labels.
    """
    scene, render = case.scene, case.scene.render
    if scene.source.labels and render.lighting != "none":
        _require_light_of_voxels(case)
    if scene.source.labels and render.classification == "preintegrated":
        raise VolprepError("VP3043", problem="a pre-integrated segment passes through all values between two labels")
    if scene.source.labels and render.classification == "palette" and render.palette_entries <= LARGEST_LABEL:
        raise VolprepError("VP3043", problem=f"they share the {render.palette_entries} entries of the palette")
    return case


def _require_light_of_voxels(case: Case) -> None:
    scene, render = case.scene, case.scene.render
    splits = splits_voxels(render.technique, render.compositing, render.decided_classification)
    needs = {
        'render.lighting = "headlight"': render.lighting == "headlight",
        'lighting.normals = "volume"': scene.lighting.normals == "volume",
        "one transfer function, whose extinction normals are made from": len(case.functions) == 1,
        "no editable": not scene.editable,
        "a compositing and a technique that split rays at the faces of voxels": splits,
    }
    missing = [need for need, is_met in needs.items() if not is_met]
    if missing:
        raise VolprepError("VP3286", lighting=render.lighting, missing="; ".join(missing))


def label_step_voxels(
    render: SceneRender, functions: Sequence[TransferFunction], voxel_mm: float, tolerance: Tolerance
) -> tuple[float, str]:
    """Return the distance of samples in voxels of `voxel_mm`, and the reason.

    Shaders split segments of emission-absorption at the faces of voxels, which is exact for steps of up to a voxel.
    Other samples have the label of one voxel: the step is so short that the densest label, along one step, has an
    opacity of a quarter of the largest error.
    """
    if splits_voxels(render.technique, render.compositing, render.decided_classification):
        return 1.0, "segments are split at the faces of voxels, which is exact for steps of up to a voxel"
    allowed_mm = -math.log1p(-_SHARE * tolerance.maximum) / max(_densest_per_mm(functions), 1e-12)
    voxels = max(_FINEST_STEP_VOXELS, min(_LONGEST_STEP_VOXELS, allowed_mm / voxel_mm))
    return voxels, "along one step the densest label stays within a quarter of the largest error"


def label_reason(render: SceneRender, functions: tuple[TransferFunction, ...], step_mm: float) -> str:
    """Say for people what becomes of labels, drawn with this step."""
    said = (
        "codes are labels, coarser levels hold no others, and a sample has the label of the voxel that it is in; "
        "labels are not interpolated"
    )
    if splits_voxels(render.technique, render.compositing, render.decided_classification):
        return said
    opacity = -math.expm1(-_densest_per_mm(functions) * step_mm)
    return (
        f"{said}; a ray that cuts a corner of the densest one within a step of {step_mm:.3g} mm is off by up to "
        f"{opacity:.2g}"
    )


def _densest_per_mm(functions: Sequence[TransferFunction]) -> float:
    return max(Table.exact(function).largest_extinction(0, MOST_LABELS) for function in functions)
