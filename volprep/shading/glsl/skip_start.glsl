//: Before the loop.
vec3 block_start = block_position(origin + ray * inside.x);
vec3 block_stride = block_offset(ray * (part / max(count, 1.0)));
float next = $FIRST;
