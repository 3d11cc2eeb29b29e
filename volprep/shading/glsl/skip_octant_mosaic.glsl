//: The octant of a direction: 1 towards smaller x, 2 smaller y, 4 smaller z.
slice += (LAST_BLOCK.z + 1.0) * dot(vec3(lessThan(stride, vec3(0.0))), vec3(1.0, 2.0, 4.0));
