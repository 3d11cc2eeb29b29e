//: One sample in the middle of the segment.
vec4 medium = classify(stored_value(start + stride * i));
