"""The plan: what a scene needs on a class of devices. Every decision is made here, once, with its reason."""

from volprep.plan.channels import make_plans
from volprep.plan.make import make_plan
from volprep.plan.products import (
    BlockRangesPlan,
    EditingPlan,
    HistogramPlan,
    NormalsPlan,
    NormalTexturePlan,
    ProgramPlan,
    ProxyMeshPlan,
    ProxyPlan,
    SkipPlan,
    SkipTablePlan,
    SlicesPlan,
    SliceStackPlan,
    SliceTexturePlan,
)
from volprep.plan.records import (
    CropPlan,
    LevelPlan,
    LookupPlan,
    PalettePlan,
    Plan,
    PreintegratedPlan,
    QuantizePlan,
    VolumePlan,
)

__all__ = [
    "BlockRangesPlan",
    "CropPlan",
    "EditingPlan",
    "HistogramPlan",
    "LevelPlan",
    "LookupPlan",
    "NormalTexturePlan",
    "NormalsPlan",
    "PalettePlan",
    "Plan",
    "PreintegratedPlan",
    "ProgramPlan",
    "ProxyMeshPlan",
    "ProxyPlan",
    "QuantizePlan",
    "SkipPlan",
    "SkipTablePlan",
    "SliceStackPlan",
    "SliceTexturePlan",
    "SlicesPlan",
    "VolumePlan",
    "make_plan",
    "make_plans",
]
