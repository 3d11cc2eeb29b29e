/** The worker of a page that digests files. Its imports are static: bundlers make one file of it by themselves. */
import { Sha256 } from "./sha256.js";
import { serve } from "./worker_loop.js";

serve(() => {
  const hash = new Sha256();
  return { take: (piece) => hash.update(piece), finish: () => hash.digest() };
});
