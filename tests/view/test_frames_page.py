"""The page of a time series: a slider draws its frames, a button plays them."""

import numpy as np
import pytest
from format_samples import SAMPLES
from view_page import opened, picture, served, text_of


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
        # The times of the last and of the first frame do not say how far they are apart.
        browser.run(
            "document.querySelector('#time-body button').click();"
            "while (window.volprep.stage.renderer.frame !== 0) await new Promise((done) => setTimeout(done, 20));"
            "document.querySelector('#time-body button').click();"
        )
        assert np.array_equal(picture(browser), first)
        assert browser.console == []
