/** Files of the page: beside it on the server, or inside it when it is one file. */

/**
 * @typedef {{generator: string, package: string, manifest_sha256: string, report: string | null, truth: string | null, devices: string | null, opaque_lengths_mm: Record<string, number>}} Settings
 */

const SETTINGS = "view.json";

/** Addresses of package and report. @returns {Promise<Settings>} */
export async function settings() {
  const inside = document.getElementById(SETTINGS);
  return inside ? JSON.parse(inside.textContent ?? "") : (await fetched(SETTINGS)).json();
}

/** The source of a package: its address, or the bytes that the page holds. @param {string} address */
export function packageSource(address) {
  const blocks = blocksOf(address);
  return blocks.length ? new Blob(blocks.map(decoded)) : new URL(address, document.baseURI).href;
}

/** A file of the report. @param {string} address @returns {Promise<Uint8Array<ArrayBuffer>>} */
export async function file(address) {
  const blocks = blocksOf(address);
  const source = blocks.length ? new Blob(blocks.map(decoded)) : await fetched(address);
  return new Uint8Array(await source.arrayBuffer());
}

/** Data of the report. @param {string} address */
export async function json(address) {
  return JSON.parse(new TextDecoder().decode(await file(address)));
}

/** @param {string} address */
async function fetched(address) {
  const response = await fetch(address, { cache: "no-store" });
  if (!response.ok) throw new Error(`${address}: the server answers ${response.status}`);
  return response;
}

/** @param {string} address */
function blocksOf(address) {
  return [...document.querySelectorAll("script[data-file]")].filter(
    (each) => each.getAttribute("data-file") === address,
  );
}

/** @param {Element} block */
function decoded(block) {
  return Uint8Array.from(atob(block.textContent ?? ""), (letter) => letter.charCodeAt(0));
}
