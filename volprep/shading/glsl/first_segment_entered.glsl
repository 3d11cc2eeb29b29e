//: Pre-integration: a segment begins where the one before ended; the first one where the ray begins to look.
float front = stored_value(start + stride * (entered - 0.5));
