"""What users make of a package, edited tables and a cut, is judged, and found where it is wrong."""

from types import SimpleNamespace

import numpy as np
import pytest
from tamper_scenes import write_kind
from tampering import built

import volprep.validation.comparison.edits_and_cuts as judged_module
from volprep.parts.editing.inputs import FunctionEdit
from volprep.render.cut import Cut
from volprep.truth.oracle import oracle_picture
from volprep.truth.volume import Volume
from volprep.validation.comparison.edits_and_cuts import edited, judge_cut, judge_edit, random_cut
from volprep.validation.subjects.scan import find_scan, read_scan
from volprep.validation.subjects.subject import Subject
from volprep.validation.timing.clock import Clock
from volprep_formats.package.channel_packages import channel_packages
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent

SIZE = 32


def bench_of(kind: str, folder) -> SimpleNamespace:
    path = built(folder, write_kind(folder, kind))
    package = next(iter(channel_packages(Package.open(path)).values()))
    scan = read_scan(package.manifest, find_scan(path, None).spec_of("scan"), Silent())
    return SimpleNamespace(subject=Subject(package, scan, SIZE), clock=Clock(), progress=Silent())


@pytest.fixture(scope="module")
def editable(tmp_path_factory) -> SimpleNamespace:
    return bench_of("editable", tmp_path_factory.mktemp("editable"))


@pytest.fixture(scope="module")
def house(tmp_path_factory) -> SimpleNamespace:
    return bench_of("house", tmp_path_factory.mktemp("house"))


def test_an_edit_is_drawn_at_every_level_and_the_finest_is_within_the_tolerance(editable) -> None:
    (program,) = editable.subject.programs
    found = [*judge_edit(editable, program, ())]
    assert [other.level for other in found] == editable.subject.levels(program)
    assert [view.view for view in found[0].views] == ["anterior-left", "anterior-right", "posterior-left"]
    assert found[0].passed
    assert max(view.rmse for view in found[0].views) < 0.01


def test_tables_of_another_function_than_the_edited_are_found(editable, monkeypatch) -> None:
    function = editable.subject.function("shell")
    monkeypatch.setattr(judged_module, "FunctionEdit", lambda _: FunctionEdit(function))
    (program,) = editable.subject.programs
    assert not any(other.passed for other in judge_edit(editable, program, ()))


def test_an_edit_changes_values_colours_and_extinctions_but_makes_none_larger(editable) -> None:
    function = editable.subject.function("shell")
    one, other = (edited(function, np.random.default_rng(7)) for _ in range(2))
    assert one == other
    for old, new in zip(function.points, one.points, strict=True):
        assert new.value != old.value
        assert sorted(new.colour) == sorted(old.colour)
        assert new.extinction_per_mm <= old.extinction_per_mm


def test_a_package_that_is_not_editable_and_has_no_pieces_is_asked_for_neither(editable, house) -> None:
    assert [*judge_edit(house, house.subject.programs[0], ())] == []
    assert [*judge_cut(editable, "shell")] == []


def test_a_cut_is_judged_in_nine_views(house) -> None:
    (found,) = judge_cut(house, "shell")
    assert found.passed
    assert len(found.views) == 9
    assert found.item.startswith("a cut of 18×15×10 voxels at 0, 0, 0")


def test_a_cut_that_is_one_voxel_off_is_found(house, monkeypatch) -> None:
    right = random_cut(house.subject)
    wrong = Cut(np.ascontiguousarray(np.roll(right.texels, 1, axis=2)), right.record)
    monkeypatch.setattr(judged_module, "random_cut", lambda _: wrong)
    (found,) = judge_cut(house, "shell")
    assert not found.passed


def test_the_box_of_the_scan_is_where_the_cut_is(house, monkeypatch) -> None:
    """A smaller box, away from the corner, so that a place that is forgotten shows."""
    monkeypatch.setattr(judged_module, "_CUT_VOXELS", 6)
    (found,) = judge_cut(house, "shell")
    assert found.passed
    record = random_cut(house.subject).record
    assert record.start_zyx != (0, 0, 0)
    box = house.subject.scan.stored[tuple(slice(*each) for each in zip(record.start_zyx, record.stop_zyx, strict=True))]
    camera = judged_module.standard_views(record.grid)["anterior"]
    truth = oracle_picture(
        Volume(np.ascontiguousarray(box), record.grid, house.subject.scan.slope, house.subject.scan.intercept),
        house.subject.function("shell"),
        camera.box_from_clip(record.grid, 1.0),
        (SIZE, SIZE),
    )
    assert truth.rgba[..., 3].max() > 0.05, "nothing is seen in the box"
