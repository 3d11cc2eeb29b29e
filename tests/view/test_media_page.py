"""Pictures of channels on several grids: the page fades each of them, and mixes two."""

import numpy as np
import pytest
from format_samples import SAMPLES
from view_page import opened, picture, served

SLIDE = """
const [name, value] = given;
const input = document.querySelector(`input[aria-label="${name}"]`);
input.value = String(value);
input.dispatchEvent(new Event("input"));
await window.volprep.stage.renderer.ready;
await new Promise((resolve) => setTimeout(resolve, 500));
return [...document.querySelectorAll("input[aria-label^='opacity of']")].map((each) => each.valueAsNumber);
"""


@pytest.fixture(scope="module")
def page(browser):
    with served(SAMPLES["two-grids"].package) as server:
        assert opened(browser, server.url) == "ready"
        yield browser


@pytest.mark.long
def test_a_mix_shows_one_channel_at_each_end_and_both_in_the_middle(page) -> None:
    both = picture(page)
    assert page.run(SLIDE, "mix of grey and hot", 1) == [0, 1]
    hot = picture(page)
    assert page.run(SLIDE, "mix of grey and hot", 0) == [1, 0]
    grey = picture(page)
    assert page.run(SLIDE, "mix of grey and hot", 0.5) == [1, 1]
    again = picture(page)
    np.testing.assert_array_equal(again, both)
    assert min(each[..., 3].max() for each in (hot, grey)) > 0.2
    # Light of one alone has more red than blue, of the other none.
    assert (hot[..., 0] - hot[..., 2]).max() > 0.1
    assert np.abs(grey[..., 0] - grey[..., 2]).max() < 0.02
    assert page.console == []


@pytest.mark.long
def test_a_link_keeps_opacities(page) -> None:
    assert page.run(SLIDE, "opacity of hot", 0.25) == [1, 0.25]
    faded = picture(page)
    page.run("document.getElementById('link').click(); await new Promise((resolve) => setTimeout(resolve, 200));")
    url = page.run("return location.href")
    page.open("about:blank")
    assert opened(page, url) == "ready"
    np.testing.assert_allclose(picture(page), faded, atol=2 / 255)
    assert page.run(SLIDE, "opacity of hot", 1) == [1, 1]
