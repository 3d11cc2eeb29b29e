"""The papers' tables on a ball of 12 voxels: rows, columns and pages, not times."""

import json
import sys
from itertools import count

import numpy as np
import pytest

from tests.papers import __main__ as run
from tests.papers import diaz_garcia, moser_weiskopf, noguera, progress, schultz_bailey
from tests.papers.bench import Bench, techniques_of
from tests.papers.browsers import about_browsers, native_and_browser
from tests.papers.lines import Line
from tests.papers.page import write_page
from tests.papers.record import Measured, Paper, PaperCurves, PaperTable
from tests.papers.tile_sizes import Sized, about_sizes
from tests.papers.volumes import Volume
from volprep.techniques import TECHNIQUES
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.source import SourceInfo


@pytest.fixture
def ball():
    z, y, x = np.meshgrid(*[np.linspace(-1.2, 1.2, 36)] * 3, indexing="ij")
    stored = (255 * np.exp(-2 * (z**2 + y**2 + x**2))).astype(np.uint8)
    grid = Grid.of(stored.shape, (1.0, 0.5, 2.0), (10.0, 20.0, 30.0), ((0, 1, 0), (1, 0, 0), (0, 0, 1)))
    return Volume("ball", "36×36×36", stored, SourceInfo(format="raw", grid=grid, stored_type="uint8"))


def test_a_smaller_volume_fills_the_box_of_the_whole(ball):
    for smaller in (ball.reduced(3), ball.resized((6, 9, 4))):
        np.testing.assert_allclose(smaller.info.grid.corner_mm_xyz, ball.info.grid.corner_mm_xyz)
        assert smaller.info.grid.extent_mm_zyx == pytest.approx(ball.info.grid.extent_mm_zyx)
    assert ball.reduced(3).stored.shape == (12, 12, 12)
    assert ball.resized((6, 9, 4)).stored.shape == (6, 9, 4)


def test_the_middle_stays_where_it_is(ball):
    part = ball.middle(10)
    assert part.stored.shape == (10, 10, 10)
    place = ball.info.grid.world_from_index @ [13, 13, 13, 1]
    np.testing.assert_allclose(part.info.grid.origin_mm_xyz, place[:3])


def test_views_for_means_are_spread_evenly_over_a_sphere(ball):
    grid = ball.info.grid
    ways = np.array([camera.forward for camera in diaz_garcia.cameras_around(grid, 60)])
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    assert np.linalg.norm(ways.mean(axis=0)) < 0.02
    # 60 equal caps that filled a sphere would have 21 degrees between neighbours.
    nearest = np.sort(ways @ ways.T, axis=1)[:, -2]
    assert np.degrees(np.arccos(nearest)).min() > 15
    for camera in diaz_garcia.cameras_around(grid, 5):
        assert np.linalg.norm(np.cross(camera.forward, camera.up)) > 0


def test_what_a_run_has_made_is_not_made_again(tmp_path):
    made = count()
    for _ in range(2):
        assert Bench(tmp_path, quick=True).remembered("a picture", lambda: next(made)) == 0
    assert Bench(tmp_path, quick=True).remembered("another", lambda: next(made)) == 1


@pytest.mark.parametrize(
    ("seconds", "where"),
    [
        ((3.0, 2.0, 1.0), "are faster holds."),
        ((1.0, 3.0, 2.0), "holds from 8² on only."),
        ((2.0, 1.0, 3.0), "holds up to 8² only."),
        ((1.0, 2.0, 3.0), "does not hold here."),
    ],
)
def test_the_sentence_about_tiles_says_where_larger_ones_are_faster(seconds, where):
    sized = [Sized("ball", size, (1000 * each,), (0.5,)) for size, each in zip((1, 8, 32), seconds, strict=True)]
    assert where in about_sizes(sized)


@pytest.mark.long
def test_a_paper_has_a_row_for_each_registered_technique_and_an_error_beside_each_time(ball, tmp_path, monkeypatch):
    monkeypatch.setattr(noguera, "scan", lambda _: ball)
    monkeypatch.setattr(noguera, "RESOLUTIONS", ((24, 32),))
    bench = Bench(tmp_path, quick=True)
    paper = noguera.measure(bench)
    published, others = (part for part in paper.parts if isinstance(part, PaperTable))
    assert published.heads == ("resolution", *[f"{what}, {n}" for what in ("rays", "slices") for n in (10, 20, 40, 80)])
    texts = {str(row[0]).partition(", ")[2] for row in others.rows}
    assert texts | {TECHNIQUES["ray-casting"].text, TECHNIQUES["view-slices-as-published"].text} == {
        TECHNIQUES[name].text for name in techniques_of("mosaic")
    }
    cells = [cell for table in (published, others) for row in table.rows for cell in row[1:]]
    assert all(isinstance(cell, Measured) and cell.ms > 0 and cell.rmse is not None for cell in cells)
    rays, slices = published.rows[0][1:5], published.rows[0][5:]
    assert rays[-1].rmse < rays[0].rmse / 4
    assert rays[-1].rmse < slices[-1].rmse
    page = write_page(paper, [], tmp_path, bench.driver, quick=True)
    assert "24" in page.read_text(encoding="utf-8")
    data = json.loads(page.with_suffix(".json").read_text(encoding="utf-8"))
    assert data["driver"] == bench.driver != ""
    assert data["parts"][0]["rows"][0][1]["rmse"] == rays[0].rmse


def test_a_page_shows_cells_curves_and_what_is_missing(tmp_path):
    table = PaperTable("Table 9", ("row", "a", "b", "c"), (("one", Measured(20.0, 0.0125, 7.0), None, "no <way>"),))
    curves = PaperCurves("Figure 9", "n", "ms", (Line("first", ((0.0, 0.0), (1.0, 2.0))),))
    paper = Paper("p", "A paper", "Nobody 2020", (table, curves), "It holds.", ("Figure 10 waits.",))
    text = write_page(paper, [], tmp_path, "some driver", quick=False).read_text(encoding="utf-8")
    for expected in (
        "50.0 fps",
        "0.0125",
        "7.00 samples",
        "no &lt;way&gt;",
        "first",
        "some driver",
        "Figure 10 waits.",
    ):
        assert expected in text, expected


SMALL = {moser_weiskopf: {"SCREEN_HW": (40, 30)}, diaz_garcia: {"QUICK_HW": (64, 36)}, schultz_bailey: {"PIXELS": 24}}


@pytest.mark.long
@pytest.mark.parametrize(("module", "patched"), SMALL.items(), ids=[each.__name__ for each in SMALL])
def test_every_paper_can_be_measured_where_nothing_is_large(ball, tmp_path, monkeypatch, module, patched):
    monkeypatch.setattr(module, "scan", lambda _: ball)
    for name, value in patched.items():
        monkeypatch.setattr(module, name, value)
    paper = module.measure(Bench(tmp_path, quick=True))
    assert paper.finding
    page = write_page(paper, [], tmp_path, "a driver", quick=True).read_text(encoding="utf-8")
    for part in paper.parts:
        assert part.title in page


def part_of(paper, figure):
    return next(part for part in paper.parts if part.title.startswith(f"{figure}:"))


@pytest.mark.long
def test_frames_of_small_tiles_differ_less_and_the_last_frame_is_the_final_picture(ball, tmp_path, monkeypatch):
    monkeypatch.setattr(diaz_garcia, "scan", lambda _: ball)
    monkeypatch.setattr(diaz_garcia, "QUICK_HW", (64, 36))
    looks = count()
    monkeypatch.setattr(progress, "honest_clock", lambda _: lambda: next(looks) / 1000)
    paper = diaz_garcia.measure(Bench(tmp_path, quick=True))
    assert [row[0] for row in part_of(paper, "Figure 9").rows] == ["1×1", "2×2", "4×4", "8×8", "16×16", "32×32"]
    means = [row[1] for row in part_of(paper, "Figure 10").rows]
    assert 0.0 < means[0] < means[3] < means[5]
    for line in part_of(paper, "Figure 12").lines:
        assert line.points[0][1] > 0.01, line.label
        assert line.points[-1][1] == 0.0, line.label
        assert line.points == tuple(sorted(line.points)), line.label
    details = part_of(paper, "Figure 11").pictures
    assert [each.caption.partition(",")[0] for each in details] == [
        *("FBSlabs", "STiles", "Simple random", "Simple structured"),
        "Final picture",
    ]
    assert details[1].png != details[-1].png


@pytest.mark.long
def test_a_browser_on_the_same_driver_draws_the_same_picture(ball, tmp_path):
    bench = Bench(tmp_path, quick=True)
    table = native_and_browser(bench, {ball: "micro-ct"}, 40)
    if table is None:
        pytest.skip("no Chromium with WebGL 2")
    (name, *native), (other, *browser) = table.rows
    assert "native" in name
    assert "Chromium" in other
    for here, there in zip(native, browser, strict=True):
        assert min(here.ms, there.ms) > 0.0
        assert there.rmse == pytest.approx(here.rmse, abs=1e-4)
        assert here.rmse < 0.02
    assert "of the time of a native program" in about_browsers(table)


@pytest.mark.long
@pytest.mark.parametrize("form", [[], ["--quick"]], ids=["full", "quick"])
def test_a_paper_that_fails_loses_no_other(tmp_path, monkeypatch, capsys, form):
    there_before = {}

    def paper_of(name, error):
        def measure(bench):
            there_before[name] = {path.name for path in tmp_path.iterdir()}
            if error is not None:
                raise error
            assert bench.quick == bool(form)
            return Paper(name, name, "Nobody 2020", (), "It holds.", ())

        return measure

    def sheet(_, folder):
        (folder / "contact-sheet.png").touch()
        return folder / "contact-sheet.png"

    fails = {"moser-weiskopf": VolprepError("VP5040", light=0), "thesis": ZeroDivisionError("by zero")}
    monkeypatch.setattr(run, "PAPERS", {name: paper_of(name, fails.get(name)) for name in run.PAPERS})
    monkeypatch.setattr(run, "write_contact_sheet", sheet)
    monkeypatch.setattr(sys, "argv", ["papers", *form, "-o", str(tmp_path)])
    with pytest.raises(SystemExit, match="1"):
        run.main()
    kept = ["noguera", "schultz-bailey", "diaz-garcia"]
    files = {f"{name}.{kind}" for name in kept for kind in ("html", "json")}
    assert {path.name for path in tmp_path.iterdir()} == files | {"contact-sheet.png", "kept"}
    assert there_before["moser-weiskopf"] == {"noguera.html", "noguera.json", "kept"}
    assert 'href="diaz-garcia.html"' in (tmp_path / "noguera.html").read_text(encoding="utf-8")
    said = capsys.readouterr()
    assert "VP5040" in said.out
    assert "ZeroDivisionError: by zero" in said.out
    assert "not measured: moser-weiskopf, thesis" in said.err
    first, *_, last = [line for line in said.out.splitlines() if " min left" in line]
    assert first.startswith("noguera: 1 of 6, about ")
    assert last.startswith("contact-sheet: 6 of 6, about ")
    # A second run continues with what is missing, and has nothing to remember when it is done.
    fails.clear()
    there_before.clear()
    monkeypatch.setattr(run, "PAPERS", {name: paper_of(name, None) for name in run.PAPERS})
    run.main()
    assert set(there_before) == {"moser-weiskopf", "thesis"}
    assert not any((tmp_path / "kept").iterdir())
    assert 'href="noguera.html"' in (tmp_path / "thesis.html").read_text(encoding="utf-8")
    there_before.clear()
    run.main()
    assert set(there_before) == set(run.PAPERS)
