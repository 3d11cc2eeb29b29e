"""Light of a volume that planes cut: a page draws it exactly when these planes cut the picture, and says so."""

import base64

import numpy as np
import pytest
from web_pictures import SIZE, box_from_clip_of, rmse

from volprep.truth.decoded import baked_fields, level_volume
from volprep.truth.refined import refined_picture
from volprep_formats.package.parts.light.planes import plane_numbers

SCRIPT = """
const { openPackage, createRenderer } = await import("/js/volpkg.js");
const pack = await openPackage(given[0]);
const renderer = await createRenderer(new OffscreenCanvas(given[2], given[2]).getContext("webgl2"), pack);
await renderer.ready;
const baked = async () => {
  renderer.draw({ boxFromClip: given[1] });
  return (await renderer.fidelity()).light;
};
const [cut] = pack.manifest.textures.find(({ light }) => light?.planes?.length).light.planes;
const plane = [...cut.normal, cut.constant_mm];
const twice = plane.map((each) => 2 * each);
const lights = {};
const light = async (name, clip, more = 0, planes = []) => {
  await renderer.setClip(clip, more);
  for (let i = 0; i < 200; i++) {
    renderer.draw({ boxFromClip: given[1], planes });
    await new Promise((resolve) => setTimeout(resolve, 5));
    lights[name] = (await renderer.fidelity()).light;
    if (i > 5 && (lights[name] === "cut") === (name === "a plane of the picture")) break;
  }
};
await light("nothing", null);
await renderer.setClip({ planes: [twice] });
lights["the plane"] = await baked();
renderer.draw({ boxFromClip: given[1] });
const bytes = new Uint8Array(renderer.readPixels().pixels.buffer);
const said = (await renderer.fidelity()).differs;
const far = [0, 0, 1, 1000];
await renderer.setClip({ planes: [plane, far] });
lights["a plane that cuts nothing beside it"] = await baked();
await light("the other side", { planes: [plane.map((each) => -each)] });
await light("another place", { planes: [[...cut.normal, cut.constant_mm - 1]] });
await light("one more plane", { planes: [plane, [0, 0, 1, -10]] });
await light("a plane of the picture", null, 1, [plane]);
await light("nothing again", null, 1);
let text = "";
for (const each of bytes) text += String.fromCharCode(each);
return { lights, said, pixels: btoa(text), error: renderer.inside.gl.getError() };
"""


@pytest.mark.long
def test_a_cut_has_its_own_light_exactly_for_its_planes(browser, server, scene_package) -> None:
    package = scene_package("light of a cut")
    matrix = box_from_clip_of(package)[6]
    server.folders["package"] = package.path.parent
    browser.open(f"{server.url}/")
    found = browser.run(SCRIPT, f"/package/{package.path.name}", matrix.T.ravel().tolist(), SIZE)
    lights = found["lights"]
    cut = {"the plane", "a plane that cuts nothing beside it", "a plane of the picture"}
    assert {name for name, light in lights.items() if light == "cut"} == cut, lights
    assert {light for name, light in lights.items() if name not in cut} == {"whole"}
    assert "light: of the cut volume" in found["said"]
    assert found["error"] == 0
    pixels = np.frombuffer(base64.b64decode(found["pixels"]), "<f4").reshape(SIZE, SIZE, 4)
    volume, function = level_volume(package, 0), package.manifest.transfer_functions[0]
    light = next(each.light for each in package.manifest.textures if each.is_of_a_cut)
    # Rays follow the planes of the package.
    pictures = [
        refined_picture(
            volume,
            function,
            matrix,
            (SIZE, SIZE),
            baked=baked_fields(package, cut=of_cut)[function.name],
            planes=plane_numbers(light.planes),
        ).rgba
        for of_cut in (True, False)
    ]
    assert rmse(pixels, pictures[0]) < 0.02
    assert rmse(pixels, pictures[1]) > 2 * rmse(pixels, pictures[0])
