/**
 * A service worker that keeps files of packages, so that they are there at once and without a network. It keeps a file
 * only if its SHA-256 is that of the manifest. Copy it to where its scope should be, and register it:
 * `navigator.serviceWorker.register("service_worker.js")`. It serves folders NAME.volpkg/; zips are left to the
 * network.
 */
const KEPT = "volpkg";
const FILE = /^(.*\.volpkg\/)([^?#]+)$/;
/** This worker's own scope. @type {any} */
const worker = self;

worker.addEventListener("install", () => worker.skipWaiting());
worker.addEventListener("activate", (/** @type {any} */ event) => event.waitUntil(worker.clients.claim()));
worker.addEventListener("fetch", (/** @type {any} */ event) => {
  const { url, method, headers } = event.request;
  const [, folder, path] = FILE.exec(url) ?? [];
  if (!path || method !== "GET" || headers.has("range")) return;
  event.respondWith(path === "manifest.json" ? manifestOf(event.request) : fileOf(event, folder, path));
});

/** The manifest of the network; without one that of the last time. @param {Request} request */
async function manifestOf(request) {
  const cache = await caches.open(KEPT);
  try {
    const answer = await fetch(request);
    if (answer.ok) await cache.put(request.url, answer.clone());
    return answer;
  } catch {
    return (await cache.match(request.url)) ?? Response.error();
  }
}

/** A file that is kept, or that of the network. @param {any} event @param {string} folder @param {string} path */
async function fileOf(event, folder, path) {
  const cache = await caches.open(KEPT);
  const manifest = await cache.match(`${folder}manifest.json`);
  const { files = [] } = manifest ? await manifest.json() : {};
  const digest = files.find((/** @type {any} */ file) => file.path === path)?.sha256;
  const key = `${folder}?sha256=${digest}`;
  const found = digest && (await cache.match(key));
  if (found) return found;
  const answer = await fetch(event.request);
  if (digest && answer.ok) event.waitUntil(keep(cache, key, digest, answer.clone()));
  return answer;
}

/**
 * Keeps a file if it is the right one.
 * @param {Cache} cache
 * @param {string} key
 * @param {string} digest
 * @param {Response} answer
 */
async function keep(cache, key, digest, answer) {
  const bytes = await answer.arrayBuffer();
  const found = [...new Uint8Array(await crypto.subtle.digest("SHA-256", bytes))];
  if (found.map((each) => each.toString(16).padStart(2, "0")).join("") !== digest) return;
  await cache.put(key, new Response(bytes, { headers: { "Content-Length": String(bytes.byteLength) } }));
}
