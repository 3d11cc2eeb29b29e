/** The message loop of a page's workers: pieces of several files come in, in order, and results go out. */

/** Work on one file. @typedef {{take: (piece: Uint8Array) => void, finish: () => unknown}} Work */

/**
 * Answers the messages of beside.js.
 * @param {(what: any, emit: (bytes: Uint8Array) => void) => Work} begin starts work on a file; `emit` sends a copy of bytes
 */
export function serve(begin) {
  /** This worker's own scope. @type {any} */
  const scope = self;
  /** @type {Map<number, Work>} */
  const works = new Map();
  const act = (/** @type {any} */ { id, what, piece, finish, end }) => {
    if (end) works.delete(id);
    const emit = (/** @type {Uint8Array} */ bytes) => {
      const texels = bytes.slice();
      scope.postMessage({ id, texels }, [texels.buffer]);
    };
    if (what) works.set(id, begin(what, emit));
    const work = works.get(id);
    if (!work) return;
    if (piece) {
      work.take(piece);
      scope.postMessage({ id, took: piece.length });
    }
    if (finish) scope.postMessage({ id, result: work.finish() ?? "" });
  };
  scope.onmessage = (/** @type {MessageEvent} */ { data }) => {
    try {
      act(data);
    } catch (problem) {
      const error = /** @type {any} */ (problem);
      works.delete(data.id);
      scope.postMessage({ id: data.id, error: { words: String(error), code: error.code, fields: error.fields } });
    }
  };
  scope.postMessage({ ready: true });
}
