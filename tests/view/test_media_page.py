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


COLOURED = """
const [open] = given;
const card = document.getElementById("slices");
card.open = open;
if (!open) return 0;
const reddest = () =>
  Math.max(
    ...[...document.querySelectorAll("#frame canvas[role=img]")].map((canvas) => {
      const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
      let most = 0;
      for (let i = 0; i < data.length; i += 4) most = Math.max(most, data[i] - data[i + 2]);
      return most;
    }),
  );
for (let turn = 0; turn < 100 && !document.getElementById("frame").classList.contains("four"); turn++)
  await new Promise((resolve) => setTimeout(resolve, 100));
await new Promise((resolve) => setTimeout(resolve, 1500));
return reddest();
"""


@pytest.mark.long
def test_slices_show_the_other_channel_in_its_colours_over_the_grey_of_the_first(page) -> None:
    assert page.run(COLOURED, True) > 40
    page.run(SLIDE, "opacity of hot", 0)
    assert page.run(COLOURED, True) == 0
    page.run(SLIDE, "opacity of hot", 1)
    page.run(COLOURED, False)
