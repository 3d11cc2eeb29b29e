"""Plans of scans with one channel."""

from volprep.pipeline.make_plan import Scanned, make_plan
from volprep.plan.records import Plan
from volprep.plan.whole_source import WholeSource
from volprep.scan.statistics import Measured
from volprep.scene.scene import Scene
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.source import SourceInfo


class PlanOfOne:
    """A plan whose only channel is asked where the package has no such decision."""

    def __init__(self, plan: Plan) -> None:
        (self.channel,) = plan.channels
        self.package = plan

    def __getattr__(self, name: str) -> object:
        return getattr(self.package, name) if hasattr(self.package, name) else getattr(self.channel, name)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, PlanOfOne) and self.package == other.package

    __hash__ = None


def plan_of_one(
    scene: Scene, profile: DeviceProfile, info: SourceInfo, measured: Measured, whole: WholeSource | None = None
) -> PlanOfOne:
    return PlanOfOne(make_plan(scene, profile, [Scanned(info, measured, whole)]))
