//: The octant of a direction: 1 towards smaller x, 2 smaller y, 4 smaller z.
ivec3 smaller = ivec3(lessThan(stride, vec3(0.0)));
texel.z += blocks.z * (smaller.x + 2 * smaller.y + 4 * smaller.z);
