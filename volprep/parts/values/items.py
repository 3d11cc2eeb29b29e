"""Items of the plan about the crop and the codes."""

import math
from collections.abc import Iterator

import numpy as np

from volprep.compositing import COMPOSITINGS
from volprep.parts.values.decision import has_bits, most_of_flip
from volprep.parts.values.labels import label_reason
from volprep.plan.decisions import ValueChoice
from volprep.plan.item_kinds import LIT_CODES
from volprep.plan.probe import SHARE, PictureDifference
from volprep.plan.records import ChannelPlan, Shared
from volprep.plan.room import has_exact_16_bits
from volprep.plan.shape_text import shape_text
from volprep.scene.scene import NormalSettings, Scene
from volprep_formats.package.manifest import PlanItem, Tolerance
from volprep_formats.package.parts.normals.record import FILTERED_CODES
from volprep_formats.source import SourceInfo

BORDER_KIND = "empty-border"
"""Kind of the item of the crop."""
WIDE_KIND = "wide-values"
"""Kind of the item of 16-bit codes."""
_WARNED = 0.75
"""Part of the tolerance beyond which light from codes is warned of: the step may take the rest."""


def describe_border(shared: Shared, scene: Scene, info: SourceInfo) -> Iterator[PlanItem]:
    """Return whether an empty border was left out."""
    source = info.grid.shape_zyx
    cropped = math.prod(source) - math.prod(shared.grid.shape_zyx)
    stored_bytes = np.dtype(info.stored_type).itemsize
    if scene.crop == "none":
        yield PlanItem(name="empty border", kind=BORDER_KIND, kept=True, reason="the scene keeps the whole scan")
    elif cropped:
        yield PlanItem(
            name="empty border",
            kind=BORDER_KIND,
            kept=False,
            reason=f"no transfer function shows it; {shape_text(shared.grid.shape_zyx)} of {shape_text(source)} voxels "
            "remain",
            size_bytes=cropped * stored_bytes,
        )


def describe_codes(plan: ChannelPlan, scene: Scene, values: ValueChoice) -> Iterator[PlanItem]:
    """Return how values become codes."""
    low, high = plan.quantize.window
    voxels = sum(math.prod(level.shape_zyx) for level in plan.levels)
    tolerance = scene.tolerance
    lit = values.lit_error
    of_light = "" if lit is None else f", and lit rays by {lit.text}"
    change = f"they change the sample of rays by {values.error.text}{of_light}"
    limit = f"half of the tolerance is RMSE {SHARE * tolerance.rmse:.2g}, {SHARE * tolerance.maximum:.2g} at most"
    if plan.quantize.bits == 16 and values.narrow_error is not None:
        limit += f"; for FLIP, RMSE {most_of_flip(tolerance):.2g} unlit"
    exact = "every stored value of the source has its own code; " if values.exact else ""
    if plan.quantize.labels:
        yield PlanItem(
            name="labels",
            kind="labels",
            kept=True,
            reason=label_reason(scene.render, plan.transfer_functions, plan.rays.step_mm),
        )
    if plan.quantize.bits == 8:
        yield PlanItem(
            name="8-bit values",
            kind="narrow-values",
            kept=True,
            reason=f"window {low:g} to {high:g}; {exact}{change}; {limit}",
        )
        reason = _why_not_wide(plan, scene)
    else:
        reason = f"window {low:g} to {high:g}; {_why_wide(scene, values)}; {_wide_texels(plan)}; {change}; {limit}"
    yield PlanItem(
        name="16-bit values", kind=WIDE_KIND, kept=plan.quantize.bits == 16, reason=reason, size_bytes=voxels
    )
    bits, held = plan.quantize.bits, values.normals_error
    if lit is not None and _is_warned(lit, tolerance):
        yield _warning(f"{bits}-bit values", lit, tolerance, _finer_light(plan))
    elif held is not None and _is_warned(held, tolerance):
        code = (scene.lit_normals or NormalSettings()).code
        finer = "allow more in [tolerance]" if code in FILTERED_CODES else 'code = "biased8", which is filtered, helps'
        yield _warning(f"{code} normals", held, tolerance, finer)


def _is_warned(error: PictureDifference, tolerance: Tolerance) -> bool:
    return error.rmse > _WARNED * tolerance.rmse or error.maximum > _WARNED * tolerance.maximum


def _warning(of_what: str, error: PictureDifference, tolerance: Tolerance, finer: str) -> PlanItem:
    return PlanItem(
        name=f"light from {of_what}",
        kind=LIT_CODES,
        kept=True,
        reason=f"{of_what} change lit rays by {error.text}; validate may find pictures beyond the tolerance (RMSE "
        f"{tolerance.rmse:.2g}, {tolerance.maximum:.2g} at most); {finer}",
    )


def _finer_light(plan: ChannelPlan) -> str:
    if plan.quantize.bits == 16:
        return "allow more in [tolerance]" if has_exact_16_bits(plan.profile) else "profile gles3-norm16 helps"
    if has_bits(plan.profile, 16):
        return "quantize.bits = 16 helps"
    return "a profile with textures of 16 bits, such as gles3, helps"


def _wide_texels(plan: ChannelPlan) -> str:
    if has_exact_16_bits(plan.profile):
        return "R16 texels hold codes unchanged"
    return (
        f"profile {plan.profile.name} has no R16, and half floats change a value by up to 2^-12 of the window: 16 "
        "codes instead of half a code"
    )


def _why_wide(scene: Scene, values: ValueChoice) -> str:
    if scene.editable:
        return "users may edit transfer functions, and 8 bits would not give every value its own code"
    narrow = values.narrow_error
    if narrow is not None and COMPOSITINGS[scene.render.compositing].isovalue:
        return "8 bits would move the surface, and with it whole pixels of its silhouette"
    if narrow is not None:
        return f"8 bits would change the sample of rays by {narrow.text}"
    return "the scene asks for 16 bits" if scene.quantize.bits == 16 else "the profile has no narrower format"


def _why_not_wide(plan: ChannelPlan, scene: Scene) -> str:
    if plan.quantize.labels:
        return "labels have 8 bits"
    if scene.quantize.bits == 8:
        return "the scene asks for 8 bits"
    if not has_bits(plan.profile, 16):
        return f"profile {plan.profile.name} has no texture format for them"
    return "8 bits are enough"
