"""The page of an editable package with baked light: it computes the light of an edited function, and says so."""

from pathlib import Path

import numpy as np
import pytest
from view_page import opened, picture, served
from web_scenes import build_scene

EDIT = """
const { renderer } = window.volprep.stage;
const before = renderer.relit;
const point = document.querySelector("#function input[min]");
point.value = given[0];
point.dispatchEvent(new Event("change"));
for (let turn = 0; renderer.relit === before && turn < 400; turn++) await new Promise((done) => setTimeout(done, 10));
await renderer.relit;
"""
SAYS = """
const line = document.getElementById("light-line");
for (let turn = 0; !line.textContent.includes(given[0]) && turn < 200; turn++)
  await new Promise((done) => setTimeout(done, 10));
return line.textContent;
"""


@pytest.mark.long
def test_the_page_computes_the_light_of_an_edited_function_and_says_so(browser, tmp_path) -> None:
    package = build_scene("editable, baked light", tmp_path)
    with served(Path(package.path)) as server:
        assert opened(browser, server.url) == "ready"
        assert browser.run(SAYS, "whole") == "Light: stored by the package, for the whole volume."
        # The first point becomes a faint haze.
        browser.run(EDIT, "0.001")
        said = "Light: ambient occlusion of your transfer function, computed on this device."
        assert browser.run(SAYS, "ambient") == said
        lit = picture(browser)
        browser.run("[...document.querySelectorAll('#function button')].at(-1).click()")
        assert browser.run(SAYS, "whole").startswith("Light: stored by the package")
        stored = picture(browser)
        assert browser.console == []
    seen = stored[..., 3] > 0.5
    assert np.abs(lit - stored)[seen, :3].mean() > 0.02
