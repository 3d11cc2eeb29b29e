"""A lie in any field of the manifest is found by validation, or the field is listed here with the reason why not.

The package is derived once for each kind. Each lie is then compared with it, as `volprep validate` does.
"""

import json
import shutil
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from every_kind import SCENES
from long_runs import LONG
from tampering import built

from volprep.validation.checks.consistency import open_whole
from volprep.validation.exact import derive as derivation
from volprep.validation.exact.findings import findings_of
from volprep.validation.subjects.scan import find_scan
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.check import check
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent

KINDS = sorted(SCENES, key="house".__ne__)
"""Kinds of packages; `make test` takes the first."""
HARMLESS = {
    "generator": "another version is reported as VP6033, which is no error",
    "plan[].reason": "reasons that state measured errors are not measured again; all others are compared",
    "statistics.non_finite": "the scans of this test have none, so that any number below is refused by the schema",
}
"""Fields in which a lie changes no picture and misleads no reader."""
FOUND_BY_PICTURES = {"fidelity", "preview"}
"""Fields that other checks compare: tests/validation/test_fidelity.py, test_preview_file.py."""
Place = tuple[str | int, ...]


def leaves(value: object, place: Place = ()) -> Iterator[tuple[Place, object]]:
    """Every number, word and truth of a JSON value, with its place."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from leaves(inner, (*place, key))
    elif isinstance(value, list):
        for index, inner in enumerate(value):
            yield from leaves(inner, (*place, index))
        if not value:
            yield place, value
    else:
        yield place, value


def field_of(place: Place) -> str:
    """The name of a field, the same for all entries of a list."""
    return "".join("[]" if isinstance(part, int) else f".{part}" for part in place).removeprefix(".")


def lie_about(value: object) -> object:
    """Another value of the same type, near enough that it might be true."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, str):
        return f"{value[:-1]}{'0' if value[-1:] != '0' else '1'}" if len(value) == 64 else f"{value}-x"
    if isinstance(value, int):
        return value + 1
    if isinstance(value, float):
        return value * 1.001 if value else 1e-6
    return ["hidden-text"] if value == [] else 1


@pytest.fixture(scope="module", params=KINDS)
def derived(request, tmp_path_factory) -> Iterator[tuple[Path, Any]]:
    """A copy of a package of one kind, and what compares a manifest with what follows from the scan."""
    folder = tmp_path_factory.mktemp(request.param)
    path = built(folder, SCENES[request.param](folder))
    taken: list[tuple[Any, ...]] = []
    with pytest.MonkeyPatch.context() as patch, TemporaryDirectory() as scratch:
        patch.setattr(derivation, "findings_of", lambda *given: taken.append(given) or ())
        derivation.derive(open_whole(path), find_scan(path, None), Path(scratch), Silent())
        ((_, draft, items),) = taken
        yield path, lambda package: findings_of(package, draft, items)


def is_found(copy: Path, manifest: object, compare: Any) -> bool:
    (copy / "manifest.json").write_text(json.dumps(manifest))
    if check(copy):
        return True
    try:
        return any(finding.code != "VP6033" for finding in compare(Package.open(copy)))
    except VolprepError:
        return True


def write_table(kind: str, verdicts: dict[str, str]) -> None:
    """Write out/tampers/KIND.md: each field, and what became of a lie in it."""
    folder = Path(__file__).parents[2] / "out" / "tampers"
    folder.mkdir(parents=True, exist_ok=True)
    counts = Counter(each.partition(":")[0] for each in verdicts.values())
    head = f"# {kind}: {len(verdicts)} lies, " + ", ".join(f"{count} {what}" for what, count in counts.items())
    rows = [f"| {field} | {verdict} |" for field, verdict in verdicts.items()]
    text = "\n".join([head, "", "| field | a lie in it is |", "|---|---|", *rows, ""])
    (folder / f"{kind}.md").write_text(text, encoding="utf-8")


@pytest.mark.long
def test_a_lie_in_any_field_is_found_or_listed_as_harmless(derived, tmp_path) -> None:
    path, compare = derived
    copy = tmp_path / "lies.volpkg"
    shutil.copytree(path, copy)
    manifest = json.loads((path / "manifest.json").read_text())
    assert not is_found(copy, manifest, compare), "the package itself is as it should be"
    tried: dict[str, Place] = {}
    for place, _ in leaves(manifest):
        tried.setdefault(field_of(place), place)
    missed = []
    verdicts = {}
    for field, place in tried.items():
        if not FOUND_BY_PICTURES.isdisjoint(place):
            verdicts[field] = "found by drawing it again"
            continue
        changed = json.loads(json.dumps(manifest))
        inner = changed
        for part in place[:-1]:
            inner = inner[part]
        inner[place[-1]] = lie_about(inner[place[-1]])
        found = is_found(copy, changed, compare)
        verdicts[field] = "found" if found else f"harmless: {HARMLESS[field]}" if field in HARMLESS else "MISSED"
        if not found and field not in HARMLESS:
            missed.append(f"{field}: {lie_about(inner[place[-1]])}")
    if LONG:
        write_table(path.parent.name.rstrip("0123456789"), verdicts)
    assert missed == []
    assert len(tried) > 100
