"""The plan: what a scene needs on a class of devices. Every decision is made here, once, with its reason."""

from volprep.plan.make import make_plan
from volprep.plan.records import CropPlan, LevelPlan, LookupPlan, Plan, ProgramPlan, QuantizePlan, VolumePlan

__all__ = ["CropPlan", "LevelPlan", "LookupPlan", "Plan", "ProgramPlan", "QuantizePlan", "VolumePlan", "make_plan"]
