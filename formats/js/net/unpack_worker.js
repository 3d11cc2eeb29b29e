/** The worker of a page that unpacks Zstandard frames; it starts with the first of them. */
import { serve } from "./worker_loop.js";
import { Frames } from "./zstd.js";

serve(({ size, file }, emit) => new Frames(size, emit, file));
