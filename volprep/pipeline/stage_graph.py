"""The stages between plan and package, as a graph: each lists the stages that it reads, which defines the order."""

from collections.abc import Iterator, Sequence

from volprep.parts.registry import PARTS
from volprep.parts.stage import Stage
from volprep.pipeline.frames import STAGE as FRAMES
from volprep.pipeline.seal import STAGE as SEAL
from volprep.plan.records import Plan
from volprep.scan.import_volume import NAME as IMPORT


def in_order(stages: Sequence[Stage]) -> tuple[Stage, ...]:
    """Return the stages, each after all that it reads; of two that could be next, the first comes first."""
    waiting = list(stages)
    names = {stage.name for stage in stages}
    done: dict[str, Stage] = {}
    while waiting:
        ready = next(stage for stage in waiting if not (set(stage.reads) & names) - done.keys())
        waiting.remove(ready)
        done[ready.name] = ready
    return tuple(done.values())


STAGES: tuple[Stage, ...] = in_order([*(stage for part in PARTS for stage in part.stages), FRAMES, SEAL])
"""The stages that follow import. Import comes before the plan, which needs its measurements."""


def planned_stages(plan: Plan) -> tuple[str, ...]:
    """Return the names of the stages that a plan needs, in order, import included."""
    return (IMPORT, *(stage.name for stage in STAGES if stage.is_needed(plan)))


def dependents(name: str) -> set[str]:
    """Return the names of the stages that read the output of a stage, directly or through others."""
    found = {name}
    for stage in STAGES:
        if found & set(stage.reads):
            found.add(stage.name)
    return found - {name}


def sources(stage: Stage, plan: Plan) -> Iterator[Stage]:
    """Return the stages whose output a stage uses, directly or indirectly, in order, if the plan needs them."""
    wanted = set(stage.reads)
    for other in reversed(STAGES):
        if other.name in wanted:
            wanted |= set(other.reads)
    return (other for other in STAGES if other.name in wanted and other.name in plan.stages)
