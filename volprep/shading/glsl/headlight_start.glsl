//: Before the loop: rays are straight, so that all of one has the same direction to the viewer.
vec3 direction = normalize(ray);
