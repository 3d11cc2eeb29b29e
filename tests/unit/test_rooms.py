"""Imports point down: between the rooms of the house, and between those of `volprep/parts`."""

import ast
import re
from collections import defaultdict
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FLOORS = (
    {"volprep_formats", "kernels"},
    {"scene", "scan", "shading", "surface", "transfer", "truth"},
    {"compositing", "techniques", "plan", "render", "vtk"},
    {"parts", "doctor"},
    {"pipeline"},
    {"judge", "validation"},
    {"report", "view"},
    {"batch", "library"},
    {"lab"},
    {"volprep_cli", "__init__"},
)
"""The rooms, the lowest floor first."""
IMPORT = re.compile(r"^ *(?:from|import) ([\w.]+)", re.MULTILINE)


@cache
def imported(path: Path) -> tuple[str, ...]:
    """Return the names of the modules that a file imports, also within functions."""
    return tuple(IMPORT.findall(path.read_text()))


def imports(root: Path, package: str) -> dict[str, set[str]]:
    """Return the rooms of a package that each of its rooms imports; a file beside the rooms is a room of its own."""
    found: dict[str, set[str]] = defaultdict(set)
    for path in root.rglob("*.py"):
        room = path.relative_to(root).parts[0].removesuffix(".py")
        for name in imported(path):
            if name.startswith(f"{package}."):
                found[room].add(name.removeprefix(f"{package}.").split(".")[0])
    return {room: others - {room} for room, others in found.items()}


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("package", ["volprep", "volprep.parts"])
def test_no_rooms_import_each_other_in_a_circle(package: str) -> None:
    order = TopologicalSorter(imports(ROOT / package.replace(".", "/"), package)).static_order()
    assert len(list(order)) > 10


def test_parts_stand_on_no_more_floors_than_the_house() -> None:
    floor: dict[str, int] = {}
    rooms = imports(ROOT / "volprep/parts", "volprep.parts")
    for room in TopologicalSorter(rooms).static_order():
        floor[room] = 1 + max((floor[other] for other in rooms.get(room, ())), default=0)
    assert max(floor.values()) <= len(FLOORS), floor


def test_a_room_imports_from_lower_floors_alone() -> None:
    floor = {room: number for number, rooms in enumerate(FLOORS) for room in rooms}
    for room, others in imports(ROOT / "volprep", "volprep").items():
        assert {other: room for other in others if floor[other] >= floor[room]} == {}
    assert "volprep_formats" not in "".join(path.read_text() for path in (ROOT / "volprep/kernels").glob("*.py"))


def test_formats_import_nothing_of_the_house_and_the_house_nothing_of_the_command_line() -> None:
    formats = ROOT / "formats/volprep_formats"
    for path in (*formats.rglob("*.py"), *(ROOT / "volprep").rglob("*.py")):
        upward = "volprep." if path.is_relative_to(formats) else "volprep_cli"
        assert not [module for module in imported(path) if module.startswith(upward)], path


def test_the_source_of_a_native_module_is_with_its_package() -> None:
    found = {}
    for path in ROOT.glob("*/native/**/CMakeLists.txt"):
        text = path.read_text()
        for module, package in re.findall(r"install\(TARGETS (\w+) DESTINATION ([\w/]+)\)", text):
            found[module] = (package.split("/")[0], path.relative_to(ROOT).parts[0])
    assert found == {
        "_native": ("volprep", "volprep"),
        "_vdb": ("volprep_formats", "formats"),
        "_dicom": ("volprep_formats", "formats"),
    }


def test_the_native_readers_include_nothing_of_the_house() -> None:
    files = [path for path in (ROOT / "formats/native").rglob("*") if path.suffix in {".cpp", ".hpp", ".txt"}]
    assert len(files) > 10
    assert [path for path in files if re.search(r'include "volprep/|volprep/native', path.read_text())] == []


def test_the_pair_of_compositings_that_are_laid_over_is_named_once() -> None:
    pair = {"emission-absorption", "back-to-front"}
    found = []
    for path in [*(ROOT / "formats/volprep_formats").rglob("*.py"), *(ROOT / "volprep").rglob("*.py")]:
        text = path.read_text()
        for node in ast.walk(ast.parse(text)) if '"back-to-front"' in text else ():
            if isinstance(node, ast.Set | ast.Tuple):
                names = {each.value for each in node.elts if isinstance(each, ast.Constant)}
                found += [path.name] if pair <= names and len(names) < 4 else []
    assert found == ["program.py"]
