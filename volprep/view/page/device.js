/** Names of this device: GPU, browser, system. Nothing else is recorded. */

/** @param {any} gl */
export function deviceNames(gl) {
  const extension = gl.getExtension("WEBGL_debug_renderer_info");
  const gpu = gl.getParameter(extension ? extension.UNMASKED_RENDERER_WEBGL : gl.RENDERER);
  const vendor = gl.getParameter(extension ? extension.UNMASKED_VENDOR_WEBGL : gl.VENDOR);
  const { browser, platform } = browserNames(navigator);
  return {
    gpu: text(gpu),
    vendor: text(vendor),
    api: "texImage3D" in gl ? "webgl2" : "webgl1",
    browser: text(browser),
    platform: text(platform),
    pixel_ratio: Math.min(64, window.devicePixelRatio || 1),
  };
}

/** @param {any} about the browser's own words about itself */
export function browserNames(about) {
  const brands =
    about.userAgentData?.brands?.filter((/** @type {any} */ each) => !/not.?a.?brand/i.test(each.brand)) ?? [];
  const brand = brands.find((/** @type {any} */ brand) => brand.brand !== "Chromium") ?? brands[0];
  const agent = about.userAgent ?? "";
  const known = [
    /(Edg)\w*\/([\d.]+)/,
    /(Firefox)\/([\d.]+)/,
    /(FxiOS)\/([\d.]+)/,
    /(CriOS)\/([\d.]+)/,
    /(Chrome)\/([\d.]+)/,
    /Version\/([\d.]+).*(Safari)/,
  ];
  const match = known.map((value) => agent.match(value)).find(Boolean);
  const [, first, second] = match ?? ["", "unknown browser", ""];
  const browser = brand
    ? `${brand.brand} ${brand.version}`
    : second === "Safari"
      ? `Safari ${first}`
      : `${first} ${second}`.trim();
  const platform =
    about.userAgentData?.platform || agent.match(/\(([^);]+;?[^);]*)/)?.[1] || about.platform || "unknown";
  return { browser, platform };
}

/** @param {unknown} value */
const text = (value) =>
  String(value ?? "")
    .replace(/[\u0000-\u001f\u007f-\u009f\u200e\u200f\u2028-\u202e\u2066-\u2069]/g, "")
    .slice(0, 300);
