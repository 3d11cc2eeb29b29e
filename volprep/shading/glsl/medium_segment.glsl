//: Pre-integration: the values at both ends of the segment whose middle is i.
float back = stored_value(start + stride * (i + 0.5));
vec4 medium = classify(front, back);
front = back;
