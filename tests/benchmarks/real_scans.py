"""Real scans as benchmarks draw them: where they are, a draft of one, and pictures with their samples and time."""

import os
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from volprep.pipeline.import_draft import import_draft
from volprep.pipeline.plan_draft import plan_draft
from volprep.pipeline.prepare import prepare
from volprep.pipeline.stages import STAGES, run_stage
from volprep.plan.records import ChannelPlan, Plan
from volprep.render.renderer import Renderer
from volprep.scene.request import load_request
from volprep.scene.scene import Scene
from volprep.truth.camera import standard_views
from volprep.validation.timing.empty_space import samples_of_views
from volprep_formats.package.reader import Package
from volprep_formats.package.storage.draft import Draft
from volprep_formats.progress import Silent

VIEWS = ("anterior", "superior", "anterior-left")
SIZE = 160
SCANS = {
    "MR head": 'path = "{}/mr_t1_studyforrest/dicoms"',
    "ch2 head": 'path = "{}/nifti_ch2/ch2.nii.gz"',
    "shell": 'path = "{}/qim_microct/shell_225x128x128.tif"',
    "fly": 'path = "{}/qim_microct/fly_150x256x256.tif"',
    "engine": 'path = "{}/engine_pair/png_stack"',
    "CT phantom": 'path = "{}/ct_phantom_tilt-18.5/S2010"\nrepair = ["tilt"]',
}
"""The source of a scene, below the folder of real scans."""
POINT = '{{ value = {}, colour = "#c0a080", extinction_per_mm = {} }}'

Points = tuple[tuple[float, float], ...]
"""Value and extinction of each point of a transfer function."""


class NoData(Exception):
    """What is to be measured is not on this machine; the text says what is missing."""


def have_scans() -> bool:
    """Whether VOLPREP_TEST_DATA says where real scans are."""
    return bool(os.environ.get("VOLPREP_TEST_DATA"))


def scans_folder() -> Path:
    """Return the folder of real scans. Raises NoData if there is none."""
    if not have_scans():
        raise NoData("VOLPREP_TEST_DATA names no folder of real scans")
    return Path(os.environ["VOLPREP_TEST_DATA"])


@dataclass(frozen=True)
class PlannedDraft:
    """The draft of a scan in which everything that its plan wants has been made."""

    draft: Draft
    plan: Plan
    scene: Scene

    def package(self) -> Package:
        """Open the draft as it is."""
        return Package.open(self.draft.folder, allow_draft=True)

    @property
    def channel(self) -> ChannelPlan:
        """Plan of its only channel."""
        (channel,) = self.plan.channels
        return channel

    def made_anew(self, stage: str, **changes: object) -> float:
        """Run a stage with another plan of the channel, then put the shaders together; milliseconds of the first."""
        stages = {each.name: each for each in STAGES}
        channel = self.channel.model_copy(update=changes)
        plan = self.plan.model_copy(update={"channels": (channel,), "stages": tuple({*self.plan.stages, stage})})
        start = time.perf_counter()
        run_stage(self.draft, stages[stage], plan, self.scene, Silent())
        build_ms = (time.perf_counter() - start) * 1000
        run_stage(self.draft, stages["shaders"], plan, self.scene, Silent())
        return build_ms


@contextmanager
def planned_draft(scan: str, functions: Mapping[str, Points]) -> Iterator[PlannedDraft]:
    """Make the draft of one of SCANS with these transfer functions, in a folder that goes. Nothing is skipped in it."""
    source = SCANS[scan].format(scans_folder())
    tables = [
        f'[[transfer]]\nname = "{name.replace(" ", "-")}"\npoints = [{", ".join(POINT.format(*p) for p in points)}]\n'
        for name, points in functions.items()
    ]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scene.toml"
        path.write_text(
            f'name = "s"\n[source]\n{source}\n[skip]\nkind = "none"\n' + "\n".join(tables), encoding="utf-8"
        )
        request = load_request(path)
        draft = import_draft(prepare(request), Path(folder) / "draft", Silent()).draft
        plan = plan_draft(draft, request.scene, request.profile, Silent())
        for stage in STAGES:
            if stage.name in plan.stages and stage.name != "seal":
                run_stage(draft, stage, plan, request.scene, Silent())
        yield PlannedDraft(draft, plan, request.scene)


@dataclass(frozen=True)
class Drawn:
    """Pictures of the finest level in three views."""

    pictures: NDArray[np.float32]
    taken: float
    """Samples that rays take."""
    looked: float
    """Entries of a skip table that they read."""
    cpu_ms: float
    """Processor time of a picture: wall time on a busy machine would make any of them look bad."""


def drawn(package: Package, transfer: str, kind: type[Renderer] = Renderer) -> Drawn:
    """Draw the finest level three times, and count what its rays read."""
    level = package.manifest.levels[0]
    cameras = [standard_views(level.grid)[view].box_from_clip(level.grid, 1.0) for view in VIEWS]
    with kind(package, level=level.index, transfer=transfer, target="rgba32f") as renderer:
        program = renderer.program
        pictures = np.stack([renderer.render(camera, (SIZE, SIZE)) for camera in cameras])
        times = []
        for _ in range(3):
            start = time.process_time()
            for camera in cameras:
                renderer.render(camera, (SIZE, SIZE))
            times.append((time.process_time() - start) * 1000 / len(cameras))
    views = [(camera, (SIZE, SIZE)) for camera in cameras]
    counts = samples_of_views(package, program, level.index, views, kind=kind)
    taken, looked = (float(sum(count.sum() for count in each)) for each in zip(*counts, strict=True))
    return Drawn(pictures, taken, looked, min(times))
