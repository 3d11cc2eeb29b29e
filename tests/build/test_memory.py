"""Memory does not grow with the depth of a volume."""

import tracemalloc

import numpy as np
import pytest
from one_after_another import OneAfterAnother

from volprep.parts.levels import appearance, choose_level, level_steps, rays, stage
from volprep.parts.levels.refined import RefineBudget
from volprep.pipeline.make_plan import Scanned, make_plan
from volprep.pipeline.stages import STAGES
from volprep.scan import slabs, statistics
from volprep.scan.import_volume import import_volume
from volprep.scan.statistics import measure
from volprep.scene.profiles import load_profile
from volprep.scene.scene import Scene
from volprep_formats.grid import Grid
from volprep_formats.package.channel import ChannelPart, SourceRecord, Statistics
from volprep_formats.package.manifest import Contribution, Heading, StageRecord
from volprep_formats.package.storage import chunks
from volprep_formats.package.storage.draft import Draft
from volprep_formats.progress import Silent
from volprep_formats.source import SourceInfo

SLICE_SHAPE = (120, 150)


class Waves:
    """A source of any depth that holds one slab at a time."""

    def __init__(self, depth: int) -> None:
        self.info = SourceInfo(format="raw", grid=Grid.of((depth, *SLICE_SHAPE), (1.0, 1.0, 1.0)), stored_type="uint16")

    def read_slab(self, z0, z1):
        z, y, x = np.ogrid[z0:z1, : SLICE_SHAPE[0], : SLICE_SHAPE[1]]
        return (z * 7 + y * 5 + x * 3).astype(np.uint16) % 4000

    def __enter__(self):
        return self

    def __exit__(self, *exception):
        pass


def stage_peaks(folder, depth: int, profile_name: str) -> dict[str, int]:
    """Largest memory of each stage but seal, in bytes."""
    source = Waves(depth)
    profile = load_profile(profile_name, folder)
    transfer = {
        "name": "a",
        "points": [
            {"value": 100, "colour": "#ff0000", "extinction_per_mm": 0},
            {"value": 3000, "colour": "#ffffff", "extinction_per_mm": 1},
        ],
    }
    scene = Scene.model_validate({"name": "s", "source": {"path": "x"}, "transfer": [transfer]})
    plan = make_plan(scene, profile, [Scanned(source.info, measure(source, Silent()))])
    draft = Draft.create(folder / str(depth), Heading(name="s", generator="test", profile=profile))
    part = ChannelPart(
        name="scan",
        source=SourceRecord(info=source.info, sha256="0" * 64),
        statistics=Statistics(minimum=0.0, maximum=1.0, non_finite=0),
    )
    heading = draft.manifest.model_copy(update={"render": plan.shared.render, "grid": plan.shared.grid})
    peaks = {}
    tracemalloc.start()
    import_volume(draft, source, Silent(), "scan")
    peaks["import"] = tracemalloc.get_traced_memory()[1]
    draft.commit(StageRecord(name="import", key="0" * 64, made=(Contribution(channel=part),)), heading)
    for each in STAGES[:-1]:
        if each.name in plan.stages:
            tracemalloc.reset_peak()
            made = each.channel.run(draft, plan.channels[0], Silent())
            peaks[each.name] = tracemalloc.get_traced_memory()[1]
            draft.commit(StageRecord(name=each.name, key="0" * 64, made=(made,)))
    tracemalloc.stop()
    return peaks


@pytest.mark.long
@pytest.mark.parametrize("profile", ["gles3", "gles2-2048"])
def test_no_stage_takes_more_for_a_deeper_volume(tmp_path, monkeypatch, profile) -> None:
    monkeypatch.setattr(slabs, "SLAB_BYTES", 150_000)
    # What has a size of its own, whatever the volume's, is made small.
    monkeypatch.setattr(choose_level, "_RAYS", 300)
    monkeypatch.setattr(rays, "MOST_SAMPLES", 100_000)
    monkeypatch.setattr(stage, "AUTO", RefineBudget(fine=150_000, coarse=750_000))
    monkeypatch.setattr(appearance, "_LONGEST_AXIS", 16)
    monkeypatch.setattr(level_steps, "_MOST_VOXELS_OF_SIDE", 16)
    monkeypatch.setattr(level_steps, "_MOST_OF_SIDE", 24)
    # A level is measured while the next one is made: which of their peaks meet is a matter of time. Neither may grow.
    monkeypatch.setattr(stage, "ThreadPoolExecutor", OneAfterAnother)
    # The samples for the plan grow with the depth: 20 kB a slice, however large it is.
    monkeypatch.setattr(statistics, "_PATCH_VOXELS", 4)
    monkeypatch.setattr(statistics, "_PROBES", 4)
    monkeypatch.setattr(statistics, "_PAIRS", 2)
    # Both have a level 3, and are deeper than what its filter reads at one time: 4 voxels, and 4 on both sides.
    shallow = stage_peaks(tmp_path, 288, profile)
    deep = stage_peaks(tmp_path, 500, profile)
    added_bytes = (500 - 288) * SLICE_SHAPE[0] * SLICE_SHAPE[1] * 2
    for name in (deep.keys() & shallow.keys()) - {"mosaic"}:
        # The fits of levels vary by 0.4 MB with the rays that they find, up and down: 288, 500 and 700 slices took
        # 5.85, 6.24 and 5.84 MB. The bound is twice that, a tenth of the voxels that came in.
        assert deep[name] - shallow[name] < 0.1 * added_bytes, name
    # A mosaic is written row of tiles by row of tiles, and the device class limits how large a row can be. One is made
    # of another, one has been given, and some wait for digest and disk.
    assert deep.get("mosaic", 0) < (3 + chunks._AHEAD) * 2048 * SLICE_SHAPE[0] * 4
