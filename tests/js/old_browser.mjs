// Takes from a browser what those of the floor do not have: Chrome 90 for WebGL 1 and 2, Safari of iOS 15.
const missing = [
  [AbortSignal, "any"],
  [AbortSignal, "timeout"],
  [AbortSignal.prototype, "throwIfAborted"],
  [AbortSignal.prototype, "reason"],
  [Array.prototype, "at"],
  [Array.prototype, "findLast"],
  [Array.prototype, "findLastIndex"],
  [Array.prototype, "toSorted"],
  [Array.prototype, "toReversed"],
  [Array.prototype, "toSpliced"],
  [Array.prototype, "with"],
  [Array, "fromAsync"],
  [String.prototype, "at"],
  [String.prototype, "isWellFormed"],
  [Object.getPrototypeOf(Int8Array.prototype), "at"],
  [Object.getPrototypeOf(Int8Array.prototype), "findLast"],
  [Object, "hasOwn"],
  [Object, "groupBy"],
  [Map, "groupBy"],
  [Promise, "withResolvers"],
  [Promise, "try"],
  [ReadableStream.prototype, Symbol.asyncIterator],
  [ReadableStream, "from"],
  [Set.prototype, "union"],
  [Set.prototype, "difference"],
  [Set.prototype, "intersection"],
  [URL, "canParse"],
  [ArrayBuffer.prototype, "transfer"],
  [globalThis, "structuredClone"],
  [globalThis, "scheduler"],
  [globalThis, "CompressionStream"],
  [globalThis, "DecompressionStream"],
  [globalThis, "ReadableStreamBYOBReader"],
  [globalThis, "OffscreenCanvas"],
  [globalThis, "requestIdleCallback"],
  [globalThis, "navigation"],
];

export const taken = missing.filter(([owner, name]) => delete owner[name]).map(([, name]) => String(name));

// Safari has streams without buffers of the app.
const getReader = ReadableStream.prototype.getReader;
ReadableStream.prototype.getReader = function (how) {
  if (how?.mode) throw new TypeError("there are no such readers");
  return getReader.call(this);
};
