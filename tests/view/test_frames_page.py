"""The page of a time series: a slider draws its frames, a button plays them."""

import numpy as np
import pytest
from format_samples import SAMPLES
from scene_builds import built
from time_series import moving, write_series
from view_page import opened, picture, served, text_of

PLAYED = """
const page = document.getElementById("time-body");
const [play] = page.querySelectorAll("button");
const [speed] = page.querySelectorAll("select");
const slider = page.querySelector("input");
const { renderer } = window.volprep.stage;
const text = () => page.querySelector("output").textContent;
const told = [document.getElementById("time").hidden, text()];
slider.value = "2";
slider.dispatchEvent(new Event("input"));
while (renderer.frame !== 2) await new Promise((resolve) => setTimeout(resolve, 10));
told.push(text());
speed.value = "0.25";
speed.dispatchEvent(new Event("change"));
const seen = new Set();
play.click();
told.push(play.textContent);
const until = performance.now() + 20000;
while (seen.size < 4 && performance.now() < until) {
  seen.add(renderer.frame);
  await new Promise((resolve) => setTimeout(resolve, 5));
}
play.click();
return { told, seen: [...seen].sort(), rests: play.textContent };
"""


@pytest.mark.long
def test_a_slider_draws_a_frame_and_a_button_plays_them(browser) -> None:
    with served(SAMPLES["time-series"].package) as server:
        assert opened(browser, server.url) == "ready"
        first = picture(browser)
        assert text_of(browser, "time-body").endswith("frame 0, 0 s")
        show = "const slider = document.querySelector('#time-body input'); slider.value = arguments[0];"
        browser.run(
            f"{show.replace('arguments[0]', '3')} slider.dispatchEvent(new Event('input'));"
            "while (window.volprep.stage.renderer.frame !== 3) await new Promise((done) => setTimeout(done, 20));"
        )
        assert text_of(browser, "time-body").endswith("frame 3, 7.50 s")
        assert np.abs(picture(browser) - first).max() > 0.02
        # The last frame is seen as long as the one before it.
        browser.run(
            "document.querySelector('#time-body button').click();"
            "while (window.volprep.stage.renderer.frame !== 0) await new Promise((done) => setTimeout(done, 20));"
            "document.querySelector('#time-body button').click();"
        )
        assert np.array_equal(picture(browser), first)
        assert browser.console == []


def test_a_series_is_played_at_a_speed_from_the_frame_that_is_shown(browser, tmp_path) -> None:
    package = built(write_series(tmp_path, moving(4)), tmp_path / "series.volpkg")
    with served(package.path) as server:
        assert opened(browser, server.url) == "ready"
        said = browser.run(PLAYED)
        assert said["told"] == [False, "frame 0, 0 s", "frame 2, 0.0800 s", "Pause"]
        assert said["seen"] == [0, 1, 2, 3]
        assert said["rests"] == "Play"
