"""Films: the frames of a series in their own time, and a turn around the volume."""

import av
import numpy as np
import pytest
from scene_builds import built
from time_series import moving, write_series

from volprep.pipeline.film import Film, shoot
from volprep.pipeline.shot import Shot, draw
from volprep.truth.picture import encoded
from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent

SHOT = Shot("anterior", None, (48, 64), "black", None, None, None, None)


@pytest.fixture(scope="module")
def series(tmp_path_factory):
    folder = tmp_path_factory.mktemp("film")
    return built(write_series(folder, moving(4)), folder / "series.volpkg").path


def pictures(path) -> tuple[list[float], list[np.ndarray]]:
    """Return times in seconds and pictures of a file."""
    with av.open(str(path)) as container:
        frames = list(container.decode(video=0))
        return [float(frame.pts * frame.time_base) for frame in frames], [
            frame.to_ndarray(format="rgb24") for frame in frames
        ]


def test_a_film_of_a_series_has_its_frames_in_their_own_time(series, tmp_path) -> None:
    count, seconds, _ = shoot(series, SHOT, Film(0, frames=True), tmp_path / "film.mp4", Silent())
    assert (count, seconds) == (4, pytest.approx(0.16))
    times, found = pictures(tmp_path / "film.mp4")
    assert times == pytest.approx([0.0, 0.04, 0.08, 0.12])
    for frame, picture in enumerate(found):
        drawn, _ = draw(series, Shot(**{**vars(SHOT), "frame": frame}))
        expected = encoded(drawn, "black").astype(float)
        assert expected.max() > 100
        # What an encoder loses: half of the places have a colour of their own.
        assert np.abs(picture - expected).mean() < 2
    assert np.abs(found[0].astype(float) - found[2]).max() > 50


def test_a_quarter_of_a_turn_shows_the_patient_from_the_side(series, tmp_path) -> None:
    shoot(series, SHOT, Film(4, frames=False), tmp_path / "turn", Silent())
    assert sorted(path.name for path in (tmp_path / "turn").iterdir()) == [f"picture_00{k}.png" for k in range(4)]
    for number, view in enumerate(("anterior", "left", "posterior", "right")):
        drawn, _ = draw(series, Shot(**{**vars(SHOT), "view": view}))
        _, (found,) = pictures(tmp_path / f"turn/picture_00{number}.png")
        assert np.abs(found.astype(int) - encoded(drawn, "black")).max() <= 1


def test_a_turn_of_a_series_plays_it_again_and_again(series, tmp_path) -> None:
    shoot(series, SHOT, Film(8, frames=True), tmp_path / "both.webp", Silent())
    shoot(series, SHOT, Film(8, frames=True), tmp_path / "again.webp", Silent())
    assert (tmp_path / "both.webp").read_bytes() == (tmp_path / "again.webp").read_bytes()
    # The last word of the chunk ANIM: 0 plays for ever.
    header = (tmp_path / "both.webp").read_bytes()
    assert header[header.index(b"ANIM") + 12 :][:2] == b"\x00\x00"
    assert header.count(b"ANMF") == 8


def test_one_frame_holds_what_all_pictures_show(series, tmp_path) -> None:
    filled = Shot(**{**vars(SHOT), "fill": True})
    shoot(series, filled, Film(6, frames=True), tmp_path / "filled", Silent())
    alphas = [pictures(path)[1][0].max(axis=2) > 60 for path in sorted((tmp_path / "filled").iterdir())]
    seen = np.any(alphas, axis=0)
    assert not seen[[0, -1]].any()
    assert not seen[:, [0, -1]].any()
    rows, columns = np.nonzero(seen)
    assert max(np.ptp(rows) / 48, np.ptp(columns) / 64) > 0.75


@pytest.mark.parametrize(
    ("name", "change", "problem"),
    [
        ("film.avi", {}, "no ending of a film"),
        ("film.mp4", {"background": "transparent"}, "no transparent pixels"),
        ("film.mp4", {"shape_hw": (47, 64)}, "even sides"),
    ],
)
def test_what_no_film_can_be_made_of_is_refused(series, tmp_path, name, change, problem) -> None:
    with pytest.raises(VolprepError, match=f"VP5026.*{problem}"):
        shoot(series, Shot(**{**vars(SHOT), **change}), Film(4, frames=False), tmp_path / name, Silent())
    assert list(tmp_path.iterdir()) == []


def test_frames_of_what_is_no_series_are_refused(tmp_path) -> None:
    alone = built(write_series(tmp_path, moving(1)[0], chosen=""), tmp_path / "alone.volpkg").path
    with pytest.raises(VolprepError, match=r"VP5026.*no time series"):
        shoot(alone, SHOT, Film(0, frames=True), tmp_path / "film", Silent())
