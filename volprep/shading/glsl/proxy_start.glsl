//: Before the loop: the first sample that is taken. Samples before the mesh see nothing; the others stay in place.
float met = dot(v_entry - origin, ray) / dot(ray, ray) - ENTRY_MARGIN_MM / length(ray);
float entered = 0.5 + max(floor((met - inside.x) / max(part, 1e-9) * count - 0.5), 0.0);
