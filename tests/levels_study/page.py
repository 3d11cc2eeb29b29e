"""What the study writes: rows as JSON and as a page, and for each subject the pictures side by side."""

import json
from collections.abc import Sequence
from dataclasses import asdict
from html import escape
from pathlib import Path

import numpy as np

from tests.levels_study.measure import SHOWN, StudyPicture, StudyRow
from tests.levels_study.promise import PromiseRow
from volprep.truth.metrics import over

_STYLE = """body { font: 14px sans-serif } td, th { padding: 2px 8px; text-align: right }
td:first-child { text-align: left } img { max-width: 100% }"""

_MARGIN = 6
"""Pixels around what is seen."""
_ENLARGED = 3


def write_study(
    rows: Sequence[StudyRow], pictures: Sequence[StudyPicture], steps: Sequence[PromiseRow], folder: Path
) -> None:
    """Write study.json, index.html and a PNG file for each subject."""
    folder.mkdir(parents=True, exist_ok=True)
    found = {"levels": [asdict(row) for row in rows], "steps": [asdict(row) for row in steps]}
    (folder / "study.json").write_text(json.dumps(found, indent=1))
    subjects = list(dict.fromkeys(row.subject for row in rows))
    parts = [f"<!doctype html><meta charset=utf-8><title>Levels</title><style>{_STYLE}</style><h1>Coarse levels</h1>"]
    parts += [f"<p>{escape(sentence)}</p>" for sentence in sentences(rows)]
    for subject in subjects:
        image = f"{subject.replace(' ', '-').replace(',', '')}.png"
        _draw([each for each in pictures if each.subject == subject], folder / image)
        parts.append(f"<h2>{escape(subject)}</h2>{_table([row for row in rows if row.subject == subject])}")
        parts += [f"<p>{escape(_promise(row))}</p>" for row in steps if row.subject == subject]
        parts.append(f'<p>A row for each level: {" | ".join(("truth", *SHOWN))}</p><img src="{image}">')
    (folder / "index.html").write_text("\n".join(parts))


def sentences(rows: Sequence[StudyRow]) -> list[str]:
    """Say in numbers what the study found."""
    found = {(row.subject, row.level, row.way): row for row in rows}
    said = []
    for level in sorted({row.level for row in rows} - {0}):
        of_optimum, of_box, kept = [], [], []
        for subject in dict.fromkeys(row.subject for row in rows):
            ways = [found.get((subject, level, way)) for way in ("auto", "box", "optimum")]
            auto, box, best = ways
            if auto is None or box is None:
                continue
            of_box.append(1 - auto.seen_rmse / box.seen_rmse)
            if best is not None and best.seen_rmse > 0:
                of_optimum.append(auto.seen_rmse / best.seen_rmse)
            if subject.startswith("vessels"):
                kept.append(auto.kept_light)
        text = f"Level {level}: the error over seen pixels is {np.mean(of_box):.0%} lower than box's (at least "
        text += f"{min(of_box):.0%})"
        if of_optimum:
            within = np.mean(np.array(of_optimum) <= 1.15)
            text += (
                f", {np.median(of_optimum):.2f} times the optimum (median; at most {max(of_optimum):.2f}; {within:.0%}"
            )
            text += " within 1.15)"
        if kept:
            text += f"; vessels keep {min(kept):.2f} to {max(kept):.2f} of their light"
        said.append(text + ".")
    return said


def _promise(row: PromiseRow) -> str:
    kept = "keeps its promise" if row.rmse <= row.limit else "misses its promise"
    numbers = f"{row.step_voxels:.3g} voxels, off by {row.rmse:.2g} in the worst of 17 views, {row.limit:.2g} promised"
    return f"The step of level {row.level} {kept}: {numbers}. The plan says: {row.reason}."


def _table(rows: Sequence[StudyRow]) -> str:
    heads = ("way", "level", "filter", "RMSE, seen", "kept light", "least kept", "kB", "s")
    lines = ["<table><tr>" + "".join(f"<th>{head}" for head in heads)]
    for row in rows:
        if row.level:
            numbers = (f"{row.seen_rmse:.4f}", f"{row.kept_light:.2f}", f"{row.least_kept:.2f}")
            cells = (row.way, row.level, row.chosen, *numbers, f"{row.size_bytes / 1e3:.0f}", f"{row.seconds:.2f}")
            lines.append("<tr>" + "".join(f"<td>{escape(str(cell))}" for cell in cells))
    return "\n".join([*lines, "</table>"])


def _draw(pictures: Sequence[StudyPicture], path: Path) -> None:
    """Write the truth and the shown ways, a row for each level, over black."""
    from matplotlib.image import imsave

    found = {(each.level, each.way): over(each.rgba, "black") for each in pictures}
    truth = found[0, "truth"]
    # Only what the truth shows, with a little around it.
    rows_seen, columns_seen = (np.flatnonzero(truth.any(axis=(1 - axis, 2))) for axis in (0, 1))
    part = tuple(
        slice(max(0, int(seen[0]) - _MARGIN), int(seen[-1]) + _MARGIN + 1) for seen in (rows_seen, columns_seen)
    )
    found = {key: picture[part].repeat(_ENLARGED, 0).repeat(_ENLARGED, 1) for key, picture in found.items()}
    truth = found[0, "truth"]
    nothing = np.zeros_like(truth)
    levels = sorted({each.level for each in pictures} - {0})
    rows = [np.hstack([truth, *(found.get((level, way), nothing) for way in SHOWN)]) for level in levels]
    imsave(path, np.clip(np.vstack(rows), 0, 1))
