// Least processor time in milliseconds of unpacking frames of a size, and of SHA-256 of what they hold: node unpack.mjs FILE SIZE
import { readFileSync } from "node:fs";
import { Sha256 } from "../../formats/js/net/sha256.js";
import { unpacked } from "../../formats/js/net/zstd.js";

const [file, size] = process.argv.slice(2);
const packed = new Uint8Array(readFileSync(file));
const least = (work) =>
  Math.min(
    ...Array.from({ length: 3 }, () => {
      const before = process.cpuUsage().user;
      work();
      return (process.cpuUsage().user - before) / 1e3;
    }),
  );
let texels = new Uint8Array(0);
const decode = least(() => (texels = unpacked(packed, Number(size), file)));
console.log(JSON.stringify([decode, least(() => new Sha256().update(texels))]));
