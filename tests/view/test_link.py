"""A link to what is on the screen: another page that opens it shows the same picture."""

from urllib.parse import quote

import numpy as np
import pytest
from browser import Browser
from format_samples import SAMPLES
from view_page import opened, picture, served, text_of

CHANGED = """
const { stage } = window.volprep;
stage.orbit.turn(0.4, 0.2);
stage.orbit.zoom = 1.5;
stage.orbit.pan(0.1, -0.05);
document.querySelector("#segments-body input[type=checkbox]").click();
const [from] = document.querySelectorAll("#cut-box input");
from.value = "60";
from.dispatchEvent(new Event("input"));
await new Promise((resolve) => setTimeout(resolve, 300));
await stage.renderer.ready;
document.getElementById("link").click();
return location.href;
"""


def test_a_link_opens_the_same_picture_with_its_cut_and_segments(browser: Browser) -> None:
    with served(SAMPLES["segments"].package) as server:
        assert opened(browser, server.url) == "ready"
        plain = picture(browser)
        link = browser.run(CHANGED)
        shown = picture(browser)
        assert np.abs(shown - plain).max() > 0.1
    with served(SAMPLES["segments"].package) as other:
        assert opened(browser, link.replace(server.url, other.url)) == "ready"
        np.testing.assert_allclose(picture(browser), shown, atol=1e-3)
        assert not browser.run("return document.querySelector('#segments-body input[type=checkbox]').checked")
        assert browser.run("return document.getElementById('cut-reset').disabled") is False
        assert browser.console == []


@pytest.mark.parametrize(
    "state", ['["",[],null]', "nonsense", '[{"forward":[1,0,0],"up":[0,0,1],"zoom":1,"pan":[0,0]},"<b>x"]']
)
def test_a_link_of_another_package_is_told(browser: Browser, state: str) -> None:
    with served(SAMPLES["segments"].package) as server:
        assert opened(browser, f"{server.url}#look={quote(state)}") in {"ready", "problem"}
        assert "The link does not fit this package" in text_of(browser, "problem")
