/**
 * Runs a task one call after the other; of those that come while it runs, only the last follows.
 * @template {unknown[]} Given
 * @param {(...given: Given) => Promise<unknown>} task
 * @param {() => void} [rested] called when no call is left
 */
export function latest(task, rested = () => {}) {
  /** @type {Given | null} */
  let next = null;
  let isBusy = false;
  return async (/** @type {Given} */ ...given) => {
    next = given;
    if (isBusy) return;
    isBusy = true;
    try {
      while (next) {
        const now = /** @type {Given} */ (next);
        next = null;
        await task(...now);
      }
    } finally {
      isBusy = false;
      rested();
    }
  };
}
