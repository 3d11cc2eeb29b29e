"""The page of a package of pieces for OpenGL ES 2.0, and a walk from point to point in it."""

from itertools import pairwise

import numpy as np
import pytest
from scene_builds import built
from view_page import opened, picture, served
from web_scenes import OTHERS

WALK = """
const { renderer } = window.volprep.stage;
await renderer.setPoint(given[0]);
const { sampling } = renderer.inside.drawn.choice.program;
return [sampling, document.querySelector("volume-viewer").shadowRoot.textContent.includes("loading")];
"""


@pytest.mark.long
def test_a_walk_through_pieces_in_mosaics_draws_each_block_and_says_nothing(browser, tmp_path) -> None:
    built(OTHERS["pieces in mosaics"](tmp_path), tmp_path / "p.volpkg")
    with served(tmp_path / "p.volpkg") as server:
        assert opened(browser, server.url) == "ready"
        whole = picture(browser)
        assert whole[..., 3].max() > 0.5
        blocks = []
        for point in (0, 9, 20, 31):
            assert browser.run(WALK, point) == ["subvolumes", False]
            blocks.append(picture(browser))
    assert max(block[..., 3].max() for block in blocks) > 0.5
    assert all(np.abs(one - other).max() > 0.1 for one, other in pairwise(blocks))
