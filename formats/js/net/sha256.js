/**
 * SHA-256 (FIPS 180-4) of bytes that come in pieces. crypto.subtle needs a file whole, copies it, and is withheld from
 * pages of plain HTTP on a local network.
 */

const [ROUNDS, START] = constants();

/** First 32 bits of the fractions of cube roots and square roots of primes. @returns {[Int32Array, Uint32Array]} */
function constants() {
  const primes = /** @type {number[]} */ ([]);
  for (let n = 2; primes.length < 64; n++) if (primes.every((prime) => n % prime)) primes.push(n);
  const bits = (/** @type {number} */ root) => (root % 1) * 2 ** 32;
  return [
    Int32Array.from(primes, (n) => bits(Math.cbrt(n))),
    Uint32Array.from(primes.slice(0, 8), (n) => bits(Math.sqrt(n))),
  ];
}

/** Takes bytes piece by piece. */
export class Sha256 {
  #state = Int32Array.from(START);
  #words = new Int32Array(64);
  #block = new Uint8Array(64);
  #filled = 0;
  #size = 0;

  /** @param {Uint8Array} bytes */
  update(bytes) {
    this.#size += bytes.length;
    let at = 0;
    if (this.#filled) {
      at = Math.min(64 - this.#filled, bytes.length);
      this.#block.set(bytes.subarray(0, at), this.#filled);
      this.#filled += at;
      if (this.#filled < 64) return;
      this.#take(this.#block, 0, 64);
    }
    this.#filled = (bytes.length - at) % 64;
    this.#take(bytes, at, bytes.length - this.#filled);
    this.#block.set(bytes.subarray(bytes.length - this.#filled));
  }

  /** The digest as 64 hexadecimal digits. Call it once. */
  digest() {
    const size = this.#size;
    const end = new Uint8Array(((this.#filled + 8) >> 6) * 64 + 64 - this.#filled);
    end[0] = 0x80;
    const view = new DataView(end.buffer);
    view.setUint32(end.length - 8, Math.floor(size / 2 ** 29));
    view.setUint32(end.length - 4, size * 8);
    this.update(end);
    return [...this.#state].map((word) => (word >>> 0).toString(16).padStart(8, "0")).join("");
  }

  /** Whole blocks from `at` to `end`. @param {Uint8Array} bytes @param {number} at @param {number} end */
  #take(bytes, at, end) {
    // Locals, not fields: three times the speed.
    const w = this.#words;
    const k = ROUNDS;
    const state = this.#state;
    while (at < end) {
      for (let i = 0; i < 16; i++, at += 4) {
        w[i] = (bytes[at] << 24) | (bytes[at + 1] << 16) | (bytes[at + 2] << 8) | bytes[at + 3];
      }
      for (let i = 16; i < 64; i++) {
        const x = w[i - 15];
        const y = w[i - 2];
        const s0 = ((x >>> 7) | (x << 25)) ^ ((x >>> 18) | (x << 14)) ^ (x >>> 3);
        const s1 = ((y >>> 17) | (y << 15)) ^ ((y >>> 19) | (y << 13)) ^ (y >>> 10);
        w[i] = (w[i - 16] + s0 + w[i - 7] + s1) | 0;
      }
      let a = state[0],
        b = state[1],
        c = state[2],
        d = state[3];
      let e = state[4],
        f = state[5],
        g = state[6],
        h = state[7];
      for (let i = 0; i < 64; i++) {
        const s1 = ((e >>> 6) | (e << 26)) ^ ((e >>> 11) | (e << 21)) ^ ((e >>> 25) | (e << 7));
        const one = (h + s1 + ((e & f) ^ (~e & g)) + k[i] + w[i]) | 0;
        const s0 = ((a >>> 2) | (a << 30)) ^ ((a >>> 13) | (a << 19)) ^ ((a >>> 22) | (a << 10));
        const two = (s0 + ((a & b) ^ (a & c) ^ (b & c))) | 0;
        h = g;
        g = f;
        f = e;
        e = (d + one) | 0;
        d = c;
        c = b;
        b = a;
        a = (one + two) | 0;
      }
      state[0] += a;
      state[1] += b;
      state[2] += c;
      state[3] += d;
      state[4] += e;
      state[5] += f;
      state[6] += g;
      state[7] += h;
    }
  }
}
