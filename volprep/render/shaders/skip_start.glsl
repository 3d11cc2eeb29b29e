//: Before the loop. Samples up to `told` are known to lie in a block that is not empty.
vec3 block_start = block_position(origin + ray * inside.x);
vec3 block_stride = block_offset(ray * (part / max(count, 1.0)));
float told = 0.0;
