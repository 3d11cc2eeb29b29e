//: The ray from its far end on, where the ends are found in the viewer's order. In and out: origin, ray, inside.
// The ray runs towards the viewer.
origin += ray;
ray = -ray;
inside = 1.0 - inside.yx;
