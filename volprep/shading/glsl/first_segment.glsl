//: Pre-integration: a segment begins where the one before ended.
float front = stored_value(start);
