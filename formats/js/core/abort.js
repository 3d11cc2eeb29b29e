/**
 * Signals that end work, for browsers without AbortSignal.any and throwIfAborted (before Chrome 116 and Safari 17.4).
 */

/** Throws an AbortError if a signal has ended the work. @param {AbortSignal} [signal] */
export function check(signal) {
  if (signal?.aborted) throw new DOMException("The work was ended.", "AbortError");
}

/**
 * A controller that aborts with any of some signals. Abort it when the work is done: it then leaves the signals.
 * @param {(AbortSignal | undefined)[]} signals
 */
export function either(...signals) {
  const made = new AbortController();
  for (const signal of signals) {
    if (signal?.aborted) made.abort();
    else signal?.addEventListener("abort", () => made.abort(), { signal: made.signal });
  }
  return made;
}
