/**
 * Zstandard frames, RFC 8878, as packages have them: frames of at most 1 MiB in a row, without dictionaries and checksums.
 * They come in pieces of any size, and no more than one frame is held.
 */

/** Largest content of a frame. spec/texture_files.md. */
const MOST_FRAME = 1 << 20;
const MOST_BLOCK = 1 << 17;
const MAGIC = 0xfd2fb528;
/** Padding after a block, so that words can be read at its end. */
const SLACK = 8;
const MOST_OFFSET_BITS = 24;

/**
 * Codes of a kind: how many bits follow each code, and what the bits are added to.
 * @typedef {{most: number, log: number, bits: Uint8Array, base: Uint32Array, standard: Fse}} Codes
 */
/**
 * States of a finite state decoder. From state s: symbol, and the next state, which is base plus so many bits.
 * @typedef {{log: number, symbols: Uint8Array, bits: Uint8Array, base: Uint16Array}} Fse
 */

/** A damaged frame. */
class Damaged extends Error {}

/** @param {boolean} is @param {string} problem */
function must(is, problem) {
  if (!is) throw new Damaged(problem);
}

/** Place of the highest bit. @param {number} value */
const highest = (value) => 31 - Math.clz32(value);

/** Bits from the end of some bytes to their start. The highest bit that is set of the last byte marks the end. */
class Backward {
  /** @type {Uint8Array} */
  bytes = new Uint8Array(SLACK);
  first = 0;
  /** Bits that are left. */
  left = 0;

  /** @param {Uint8Array} bytes with SLACK behind `end` @param {number} start @param {number} end */
  set(bytes, start, end) {
    must(end > start && bytes[end - 1] > 0, "a stream of bits has no end");
    this.bytes = bytes;
    this.first = start;
    this.left = 8 * (end - start - 1) + highest(bytes[end - 1]);
    return this;
  }

  /** @param {number} count at most 24 */
  read(count) {
    const at = (this.left -= count);
    if (at < 0) return this.#beyond(count);
    const { bytes } = this;
    const i = this.first + (at >> 3);
    return (
      ((bytes[i] | (bytes[i + 1] << 8) | (bytes[i + 2] << 16) | (bytes[i + 3] << 24)) >>> (at & 7)) & ((1 << count) - 1)
    );
  }

  /** Bits before the start are 0. @param {number} count */
  #beyond(count) {
    const kept = count + this.left;
    if (kept <= 0) return 0;
    let value = 0;
    for (let i = 0; i < kept; i += 8) value |= this.bytes[this.first + (i >> 3)] << i;
    return (value & ((1 << kept) - 1)) << -this.left;
  }
}

/**
 * @param {readonly number[]} counts of each symbol among all states; −1 for less than one @param {number} log
 * @returns {Fse}
 */
function statesOf(counts, log) {
  const size = 1 << log;
  const symbols = new Uint8Array(size);
  const next = counts.map((count) => Math.abs(count));
  let high = size;
  counts.forEach((count, symbol) => {
    if (count < 0) symbols[--high] = symbol;
  });
  const stride = (size >> 1) + (size >> 3) + 3;
  let at = 0;
  counts.forEach((count, symbol) => {
    for (let i = 0; i < count; i++) {
      symbols[at] = symbol;
      do at = (at + stride) & (size - 1);
      while (at >= high);
    }
  });
  const bits = new Uint8Array(size);
  const base = new Uint16Array(size);
  symbols.forEach((symbol, state) => {
    const place = next[symbol]++;
    bits[state] = log - highest(place);
    base[state] = (place << bits[state]) - size;
  });
  return { log, symbols, bits, base };
}

/** The state that always gives one symbol. @param {number} symbol @returns {Fse} */
const always = (symbol) => ({
  log: 0,
  symbols: Uint8Array.of(symbol),
  bits: new Uint8Array(1),
  base: new Uint16Array(1),
});

/**
 * Reads how often each symbol occurs. RFC 8878, 4.1.1.
 * @param {Uint8Array} bytes @param {number} start @param {number} end @param {number} mostLog @param {number} mostSymbol
 * @returns {[Fse, number]} and where it ends
 */
function readStates(bytes, start, end, mostLog, mostSymbol) {
  let at = 0;
  const read = (/** @type {number} */ count) => {
    const i = start + (at >> 3);
    const word = bytes[i] | (bytes[i + 1] << 8) | (bytes[i + 2] << 16);
    at += count;
    return (word >> ((at - count) & 7)) & ((1 << count) - 1);
  };
  const log = read(4) + 5;
  must(log <= mostLog, "a table has too many states");
  let left = 1 << log;
  /** @type {number[]} */
  const counts = [];
  while (left > 0 && counts.length <= mostSymbol && start + (at >> 3) < end) {
    const wide = highest(left + 1) + 1;
    // This number of possible values is coded with one bit less.
    const short = (1 << wide) - 2 - left;
    let value = read(wide - 1);
    if (value >= short) {
      value |= read(1) << (wide - 1);
      if (value >= 1 << (wide - 1)) value -= short;
    }
    counts.push(value - 1);
    left -= Math.abs(value - 1);
    if (value !== 1) continue;
    for (let more = 3; more === 3 && counts.length <= mostSymbol; ) {
      more = read(2);
      for (let i = 0; i < more; i++) counts.push(0);
    }
  }
  const stop = start + ((at + 7) >> 3);
  must(left === 0 && counts.length <= mostSymbol + 1 && stop <= end, "a table of states is wrong");
  return [statesOf(counts, log), stop];
}

/** @param {string} widths bits of the last codes, those before have none @param {number} plain codes without bits @param {number} first value of code 0 @param {readonly number[]} counts @param {number} log @param {number} most states */
function codes(widths, plain, first, counts, log, most) {
  const bits = Uint8Array.from([...Array(plain).fill(0), ...widths.split(" ").map(Number)]);
  const base = new Uint32Array(bits.length);
  let value = first;
  bits.forEach((count, code) => {
    base[code] = value;
    value += 2 ** count;
  });
  return { most: bits.length - 1, log: most, bits, base, standard: statesOf(counts, log) };
}

const LITERALS = codes(
  "1 1 1 1 2 2 3 3 4 6 7 8 9 10 11 12 13 14 15 16",
  16,
  0,
  [4, 3, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2, 1, 1, 1, 2, 2, 2, 2, 2, 2, 2, 2, 2, 3, 2, 1, 1, 1, 1, 1, -1, -1, -1, -1],
  6,
  9,
);
const MATCHES = codes(
  "1 1 1 1 2 2 3 3 4 4 5 7 8 9 10 11 12 13 14 15 16",
  32,
  3,
  [
    1, 4, 3, 2, 2, 2, 2, 2, 2, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1,
    1, 1, 1, 1, 1, 1, 1, -1, -1, -1, -1, -1, -1, -1,
  ],
  6,
  9,
);
const OFFSETS = codes(
  Array.from({ length: 32 }, (_, code) => code).join(" "),
  0,
  1,
  [1, 1, 1, 1, 1, 1, 2, 2, 2, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, -1, -1, -1, -1, -1],
  5,
  8,
);

/** Reads the weights of symbols, and makes of them a table: of each code the bits that it has, and the symbol. */
class Huffman {
  /** Bits of the longest code. */
  most = 0;
  table = new Uint16Array(1 << 11);

  /** @param {Uint8Array} bytes @param {number} start @param {number} end @returns {number} where they end */
  read(bytes, start, end) {
    const head = bytes[start++];
    const stop = start + (head < 128 ? head : (head - 126) >> 1);
    must(stop <= end, "weights are cut off");
    const weights =
      head < 128
        ? packedWeights(bytes, start, stop)
        : Array.from({ length: head - 127 }, (_, i) =>
            i % 2 ? bytes[start + (i >> 1)] & 15 : bytes[start + (i >> 1)] >> 4,
          );
    const sum = weights.reduce((all, weight) => all + (weight ? 2 ** (weight - 1) : 0), 0);
    must(sum > 0 && sum < 1 << 11, "weights have no sum of codes");
    this.most = highest(sum) + 1;
    const rest = (1 << this.most) - sum;
    must((rest & (rest - 1)) === 0, "the last weight is no power of two");
    weights.push(highest(rest) + 1);
    let at = 0;
    for (let weight = 1; weight <= this.most; weight++) {
      weights.forEach((each, symbol) => {
        if (each === weight) this.table.fill(((this.most + 1 - weight) << 8) | symbol, at, (at += 1 << (weight - 1)));
      });
    }
    return stop;
  }

  /** Reads symbols into `to`. @param {Uint8Array} bytes @param {number} start @param {number} end @param {Uint8Array} to @param {number} from @param {number} until */
  symbols(bytes, start, end, to, from, until) {
    const { most, table } = this;
    must(end > start && bytes[end - 1] > 0, "a stream of bits has no end");
    let left = 8 * (end - start - 1) + highest(bytes[end - 1]);
    const mask = (1 << most) - 1;
    let i = from;
    // Two codes have at most 22 bits, and begin within a byte.
    while (i < until - 1 && left >= 32) {
      const at = left - 2 * most;
      const k = start + (at >> 3);
      const word = (bytes[k] | (bytes[k + 1] << 8) | (bytes[k + 2] << 16) | (bytes[k + 3] << 24)) >>> (at & 7);
      const one = table[(word >>> most) & mask];
      const other = table[(word >>> (2 * most - (most + (one >> 8) - most) - most)) & mask];
      to[i++] = one;
      to[i++] = other;
      left -= (one >> 8) + (other >> 8);
    }
    for (; i < until; i++) {
      const at = left - most;
      const k = start + (Math.max(at, 0) >> 3);
      const word = bytes[k] | (bytes[k + 1] << 8) | (bytes[k + 2] << 16);
      const found = table[(at < 0 ? (word & ((1 << Math.max(left, 0)) - 1)) << -at : word >> (at & 7)) & mask];
      to[i] = found;
      left -= found >> 8;
    }
    must(left === 0, "literals do not take all bits of their stream");
  }
}

/** @param {Uint8Array} bytes @param {number} start @param {number} end @returns {number[]} */
function packedWeights(bytes, start, end) {
  const [{ log, symbols, bits, base }, at] = readStates(bytes, start, end, 6, 255);
  const stream = new Backward().set(bytes, at, end);
  const states = [stream.read(log), stream.read(log)];
  must(stream.left >= 0, "weights are cut off");
  const weights = [];
  for (let turn = 0; weights.length < 255; turn ^= 1) {
    weights.push(symbols[states[turn]]);
    states[turn] = base[states[turn]] + stream.read(bits[states[turn]]);
    if (stream.left < 0) {
      weights.push(symbols[states[turn ^ 1]]);
      must(weights.length < 256, "there are too many weights");
      must(
        weights.every((weight) => weight <= 11),
        "a weight is too large",
      );
      return weights;
    }
  }
  throw new Damaged("there are too many weights");
}

/** An error with a code and no text: the page has the words. */
class Coded extends Error {
  /** @param {string} code @param {Record<string, unknown>} fields */
  constructor(code, fields) {
    super(code);
    this.code = code;
    this.fields = fields;
  }
}

/** Class of errors. @typedef {new (code: string, fields: Record<string, unknown>) => Error} Failure */

/** Unpacks the frames of a level. It imports nothing, so that a worker takes no other module for it. */
export class Frames {
  #size;
  #Failure;
  #emit;
  #file;
  #given = 0;
  /** The next part of the input: its bytes, their number, the number that is needed, and the next step. */
  #in = new Uint8Array(MOST_BLOCK + SLACK);
  #have = 0;
  #need = 5;
  /** @type {() => void} */
  #then = () => this.#head();
  #out;
  #at = 0;
  #content = 0;
  #last = false;
  #kind = 0;
  #literals = new Uint8Array(MOST_BLOCK);
  #huffman = new Huffman();
  #recent = [1, 4, 8];
  /** Tables of literal lengths, offsets and match lengths, which a block may take over from the one before. @type {(Fse | null)[]} */
  #tables = [null, null, null];
  #bits = new Backward();

  /**
   * @param {number} size of their content, all together
   * @param {(bytes: Uint8Array) => void} emit receives the content of each frame, valid until it returns
   * @param {string} file for messages
   * @param {Failure} [Failure] class of errors
   */
  constructor(size, emit, file, Failure = Coded) {
    this.#size = size;
    this.#Failure = Failure;
    this.#emit = emit;
    this.#file = file;
    this.#out = new Uint8Array(Math.min(MOST_FRAME, size));
  }

  /** Bytes that follow those before. @param {Uint8Array} piece */
  take(piece) {
    this.#guarded(() => {
      let at = 0;
      while (at < piece.length || this.#have === this.#need) {
        const part = piece.subarray(at, at + this.#need - this.#have);
        this.#in.set(part, this.#have);
        this.#have += part.length;
        at += part.length;
        if (this.#have < this.#need) return;
        this.#have = 0;
        this.#then();
      }
    });
  }

  /** Throws where there is not all of it. */
  finish() {
    this.#guarded(() =>
      must(
        this.#given === this.#size && this.#have === 0 && this.#need === 5,
        `it ends after ${this.#given} of ${this.#size} bytes`,
      ),
    );
  }

  /** @param {() => void} work */
  #guarded(work) {
    try {
      work();
    } catch (error) {
      if (!(error instanceof Damaged)) throw error;
      throw new this.#Failure("VP4030", {
        name: this.#file,
        problem: `its Zstandard frames are damaged: ${error.message}`,
      });
    }
  }

  /** @param {number} bytes @param {() => void} then */
  #expect(bytes, then) {
    this.#need = bytes;
    this.#then = then;
  }

  /** Magic number and flags of a frame. */
  #head() {
    const view = new DataView(this.#in.buffer);
    const flags = this.#in[4];
    const single = (flags >> 5) & 1;
    const length = [single, 2, 4, 8][flags >> 6];
    must(view.getUint32(0, true) === MAGIC, "one does not begin with the number of Zstandard");
    must((flags & 15) === 0 && length > 0, "one has a checksum or a dictionary, or does not state its size");
    this.#expect(1 - single + length, () => {
      const at = 1 - single;
      const low =
        length === 1 ? this.#in[at] : length === 2 ? view.getUint16(at, true) + 256 : view.getUint32(at, true);
      this.#content = low + (length === 8 ? view.getUint32(at + 4, true) * 2 ** 32 : 0);
      must(
        this.#content > 0 && this.#content <= MOST_FRAME && this.#given + this.#content <= this.#size,
        `one holds ${this.#content} bytes`,
      );
      this.#at = 0;
      this.#recent = [1, 4, 8];
      this.#tables = [null, null, null];
      this.#huffman.most = 0;
      this.#expect(3, () => this.#blockHead());
    });
  }

  #blockHead() {
    const [a, b, c] = this.#in;
    const word = a | (b << 8) | (c << 16);
    const size = word >> 3;
    this.#last = (word & 1) === 1;
    this.#kind = (word >> 1) & 3;
    must(this.#kind !== 3 && size <= MOST_BLOCK, "a block is of no kind or too large");
    this.#expect(this.#kind === 1 ? 1 : size, () => this.#block(size));
  }

  /** @param {number} size */
  #block(size) {
    const from = this.#at;
    if (this.#kind === 2) this.#packed(size);
    else {
      must(from + size <= this.#content, "a block holds more than its frame");
      if (this.#kind === 1) this.#out.fill(this.#in[0], from, from + size);
      else this.#out.set(this.#in.subarray(0, size), from);
      this.#at += size;
    }
    must(this.#at - from <= MOST_BLOCK, "a block holds too much");
    if (!this.#last) {
      this.#expect(3, () => this.#blockHead());
      return;
    }
    must(this.#at === this.#content, `one holds ${this.#at} bytes instead of ${this.#content}`);
    this.#given += this.#content;
    this.#emit(this.#out.subarray(0, this.#content));
    this.#expect(5, () => this.#head());
  }

  /** @param {number} end bytes of the block */
  #packed(end) {
    must(end > 1, "a block has no sections");
    const [at, literals] = this.#section(end);
    const bytes = this.#in;
    let count = bytes[at];
    let next = at + 1;
    if (count > 127) {
      count = count < 255 ? ((count - 128) << 8) + bytes[next] : bytes[next] + (bytes[next + 1] << 8) + 0x7f00;
      next += bytes[at] < 255 ? 1 : 2;
    }
    must(next <= end, "sequences are cut off");
    if (count) this.#sequences(count, next, end, literals);
    else {
      must(next === end, "a block goes on behind its sequences");
      this.#copy(literals, 0, literals.length);
    }
  }

  /** Literals of a block: end of their section, and bytes. @param {number} end @returns {[number, Uint8Array]} */
  #section(end) {
    const bytes = this.#in;
    const kind = bytes[0] & 3;
    const format = (bytes[0] >> 2) & 3;
    const word = bytes[0] + bytes[1] * 2 ** 8 + bytes[2] * 2 ** 16 + bytes[3] * 2 ** 24 + bytes[4] * 2 ** 32;
    if (kind < 2) {
      const [head, shift] = [
        [1, 3],
        [2, 4],
        [1, 3],
        [3, 4],
      ][format];
      const size = Math.floor((word % 2 ** (8 * head)) / 2 ** shift);
      must(size <= MOST_BLOCK && head + (kind ? 1 : size) <= end, "literals are cut off");
      return kind
        ? [head + 1, this.#literals.fill(bytes[head], 0, size).subarray(0, size)]
        : [head + size, bytes.subarray(head, head + size)];
    }
    const width = [10, 10, 14, 18][format];
    const head = [3, 3, 4, 5][format];
    const size = Math.floor(word / 16) % 2 ** width;
    const stop = head + (Math.floor(word / 2 ** (4 + width)) % 2 ** width);
    must(size <= MOST_BLOCK && head < stop && stop <= end, "literals are cut off");
    let at = head;
    if (kind === 2) at = this.#huffman.read(bytes, at, stop);
    must(this.#huffman.most > 0, "literals have no codes");
    const to = this.#literals;
    if (format === 0) this.#huffman.symbols(bytes, at, stop, to, 0, size);
    else {
      const share = (size + 3) >> 2;
      let from = at + 6;
      must(from <= stop && 3 * share <= size, "literals are cut off");
      for (let i = 0; i < 4; i++) {
        const until = i < 3 ? from + bytes[at + 2 * i] + (bytes[at + 2 * i + 1] << 8) : stop;
        must(until <= stop, "literals are cut off");
        this.#huffman.symbols(bytes, from, until, to, i * share, i < 3 ? (i + 1) * share : size);
        from = until;
      }
    }
    return [stop, to.subarray(0, size)];
  }

  /** @param {number} count @param {number} at @param {number} end @param {Uint8Array} literals */
  #sequences(count, at, end, literals) {
    const bytes = this.#in;
    const modes = bytes[at++];
    must(at <= end && (modes & 3) === 0, "modes of sequences are wrong");
    const [ll, of, ml] = [LITERALS, OFFSETS, MATCHES].map(({ most, log, standard }, i) => {
      const mode = (modes >> (6 - 2 * i)) & 3;
      if (mode === 0) this.#tables[i] = standard;
      else if (mode === 1) this.#tables[i] = always(bytes[at++]);
      else if (mode === 2) [this.#tables[i], at] = readStates(bytes, at, end, log, most);
      const table = this.#tables[i];
      must(at <= end && table !== null && (mode !== 1 || table.symbols[0] <= most), "sequences have no table");
      return /** @type {Fse} */ (table);
    });
    const bits = this.#bits.set(bytes, at, end);
    let [l, o, m] = [ll, of, ml].map(({ log }) => bits.read(log));
    let [first, second, third] = this.#recent;
    let used = 0;
    for (let i = 0; i < count; i++) {
      const code = of.symbols[o];
      must(code <= MOST_OFFSET_BITS, "an offset is too large");
      const value = (1 << code) + bits.read(code);
      const match = ml.symbols[m];
      const length = MATCHES.base[match] + (match < 32 ? 0 : bits.read(MATCHES.bits[match]));
      const literal = ll.symbols[l];
      const before = literal < 16 ? literal : LITERALS.base[literal] + bits.read(LITERALS.bits[literal]);
      let offset = value - 3;
      if (value > 3) {
        third = second;
        second = first;
        first = offset;
      } else {
        const which = value - (before ? 1 : 0);
        offset = which === 0 ? first : which === 1 ? second : which === 2 ? third : first - 1;
        if (which > 1) third = second;
        if (which > 0) second = first;
        first = offset;
      }
      must(bits.left >= 0 && used + before <= literals.length, "sequences are cut off");
      this.#copy(literals, used, before);
      used += before;
      this.#repeat(offset, length);
      if (i === count - 1) break;
      l = ll.base[l] + bits.read(ll.bits[l]);
      m = ml.base[m] + bits.read(ml.bits[m]);
      o = of.base[o] + bits.read(of.bits[o]);
    }
    must(bits.left === 0, "sequences do not take all bits of their stream");
    this.#recent = [first, second, third];
    this.#copy(literals, used, literals.length - used);
  }

  /** @param {Uint8Array} literals @param {number} from @param {number} count */
  #copy(literals, from, count) {
    const at = this.#at;
    must(at + count <= this.#content, "a block holds more than its frame");
    if (count > 32) this.#out.set(literals.subarray(from, from + count), at);
    else for (let i = 0; i < count; i++) this.#out[at + i] = literals[from + i];
    this.#at = at + count;
  }

  /** Copies earlier output from a distance. @param {number} offset @param {number} length */
  #repeat(offset, length) {
    const out = this.#out;
    const at = this.#at;
    const from = at - offset;
    must(offset > 0 && from >= 0 && at + length <= this.#content, "an offset leads out of its frame");
    if (offset >= length && length > 32) out.copyWithin(at, from, from + length);
    else if (offset === 1 && length > 32) out.fill(out[from], at, at + length);
    else for (let i = 0; i < length; i++) out[at + i] = out[from + i];
    this.#at = at + length;
  }
}

/**
 * All that a level holds.
 * @param {Uint8Array} bytes of its frames @param {number} size @param {string} file for messages @param {Failure} [Failure]
 */
export function unpacked(bytes, size, file, Failure) {
  const all = new Uint8Array(size);
  let at = 0;
  const frames = new Frames(size, (part) => all.set(part, (at += part.length) - part.length), file, Failure);
  frames.take(bytes);
  frames.finish();
  return all;
}
