"""volprep study ablation: what each item of a package is worth."""

import json
from pathlib import Path
from typing import TYPE_CHECKING

from volprep_cli.console import bytes_text, end_beyond, print_json, print_line, print_table, wants_json
from volprep_cli.outputs import Package
from volprep_cli.studies.of_package import Output, Size, Source, make_study
from volprep_formats.diagnostics import VolprepError

if TYPE_CHECKING:
    from volprep.lab.ablation.records import Ablation, Measurement


def ablation(package: Package, output: Output, *, source: Source = None, size: Size = None) -> None:
    """Measure what each item of a package is worth, by leaving it out or adding it: about fifteen packages.

    Writes ablation.html and ablation.json. Takes minutes. Exit status 0: each item earns its place. 1: one does not.
    """
    make_study("ablation", package, output, source=source, size=size)
    if wants_json():
        print_json(json.loads((output / "ablation.json").read_bytes()))
    end_with_ablation(package, output)


def end_with_ablation(package: Path, folder: Path) -> None:
    """Print the ablation that was written to `folder`; end with VP6081 if the plan is wrong about an item."""
    from volprep.lab.ablation.records import Ablation

    found = Ablation.model_validate_json((folder / "ablation.json").read_bytes())
    if not wants_json():
        _print_ablation(found)
    if found.faults:
        fields = {"count": len(found.faults), "listed": ", ".join(found.faults), "report": folder / "ablation.html"}
        end_beyond(VolprepError("VP6081", path=package, **fields))


def _print_ablation(found: "Ablation") -> None:
    from volprep.lab.ablation.records import Measurement, name_of

    packages: list[tuple[str, str, Measurement | None, float | None]] = [("as planned", "", found.planned, None)]
    if found.everything is not None:
        packages.append(("with everything", "", found.everything, None))
    packages += [
        (f"{'without' if row.kept else 'with'} {name_of(row)}", row.outcome, row.other, row.change_maximum)
        for row in found.rows
    ]
    rows = [
        (name, *_measured(other), "" if change is None else f"{change:.2g}", outcome)
        for name, outcome, other, change in packages
    ]
    print_line("leaving out: each package beside the one as planned")
    heads = ("package", "bytes", "upload", "GPU memory", "ms", "times as long", "RMSE", "changes a view", "outcome")
    print_table(heads, rows)
    print_line("")


def _measured(other: "Measurement | None") -> tuple[str, ...]:
    from volprep.report.text import number

    if other is None:
        return ("",) * 6
    ratio = "1" if other.ratio is None else f"{other.ratio.median:.2f} ({other.ratio.low:.2f}–{other.ratio.high:.2f})"
    sizes = (bytes_text(size) for size in (other.package_bytes, other.upload_bytes, other.gpu_bytes))
    return (*sizes, number(other.milliseconds), ratio, number(other.rmse))
