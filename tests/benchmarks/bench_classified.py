"""Coarse levels of classified voxels: how near the light of random rays comes to that of level 0, on real scans.

The scans and transfer functions are those of bench_levels.py. Box is a level of values that is classified after it; its
neighbours are levels of classified voxels. What a build does is compared: "auto" takes the one whose light is nearest.
"""

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table as Rows

from volprep.parts.levels.classified import CLASSIFIED_CANDIDATES, ClassifiedChooser
from volprep.parts.levels.level_input import LevelInput
from volprep.parts.texels import voxels_of
from volprep.parts.work import codes_of_source
from volprep.pipeline.import_draft import import_draft
from volprep.pipeline.plan_draft import plan_draft
from volprep.pipeline.prepare import prepare
from volprep.pipeline.stages import STAGES, run_stage
from volprep.scene.request import Request
from volprep.transfer.lookup import lookup_table
from volprep_formats.progress import Silent

from .bench_levels import LEVELS, SCENES, request_of
from .real_scans import scans_folder


@dataclass(frozen=True)
class ClassifiedRow:
    """One level of one scan, classified by one transfer function."""

    scan: str
    """Name of the scan."""
    level: int
    """Level."""
    transfer: str
    """Transfer function."""
    reference_mm: float
    """Length of the path whose opacity voxels have."""
    rmse: dict[str, float]
    """Error of light for each filter: root mean square, premultiplied linear."""
    seconds: dict[str, float]
    """What each took."""


def measure_classified(console: Console) -> Iterator[ClassifiedRow]:
    """Measure all scans."""
    data = scans_folder()
    for scan in SCENES:
        console.print(f"measuring classified levels of {scan}", style="dim")
        with tempfile.TemporaryDirectory() as folder:
            request = request_of(scan, data, Path(folder))
            for transfer in request.scene.transfer:
                yield from _rows(scan, request, transfer.name, Path(folder) / transfer.name)


def _rows(scan: str, request: Request, transfer: str, folder: Path) -> list[ClassifiedRow]:
    render = request.scene.render.model_copy(update={"classification": "preclassified"})
    functions = tuple(each for each in request.scene.transfer if each.name == transfer)
    scene = request.scene.model_copy(update={"render": render, "transfer": functions})
    draft = import_draft(prepare(request), folder, Silent()).draft
    of_package = plan_draft(draft, scene, request.profile, Silent())
    run_stage(draft, next(stage for stage in STAGES if stage.name == "quantize"), of_package, scene, Silent())
    (plan,) = of_package.channels
    voxels = voxels_of(plan)
    table = lookup_table(voxels.function, voxels.window, 256)
    chooser = ClassifiedChooser(LevelInput(codes_of_source(draft, plan), plan.grid, {transfer: table}), voxels)
    rows = []
    for level in LEVELS:
        factors = plan.level(level).factors_zyx
        choice, _ = chooser.choose(level, factors, CLASSIFIED_CANDIDATES, draft.scratch, lambda _: None)
        errors = {trial.filter: trial.rmse for trial in choice.trials}
        seconds = {trial.filter: trial.seconds for trial in choice.trials}
        rows.append(ClassifiedRow(scan, level, transfer, voxels.reference_mm, errors, seconds))
    return rows


def classified_table(rows: list[ClassifiedRow]) -> Rows:
    """Draw the rows for people."""
    table = Rows(title="Error of light of coarse levels of classified voxels")
    for name in ("scan", "level", "transfer", "of mm", *CLASSIFIED_CANDIDATES, "chosen", "lower than box by"):
        table.add_column(name, justify="left" if name in {"scan", "transfer", "chosen"} else "right")
    gains: dict[int, list[float]] = {level: [] for level in LEVELS}
    for row in rows:
        chosen = min(row.rmse, key=lambda name: row.rmse[name])
        gain = 1 - row.rmse[chosen] / row.rmse["box"]
        gains[row.level].append(gain)
        tried = [f"{row.rmse[name]:.4f} {row.seconds[name]:.1f} s" for name in CLASSIFIED_CANDIDATES]
        table.add_row(row.scan, str(row.level), row.transfer, f"{row.reference_mm:.3g}", *tried, chosen, f"{gain:.1%}")
    table.caption = "; ".join(f"level {level} lower by {np.mean(each):.1%}" for level, each in gains.items() if each)
    return table
