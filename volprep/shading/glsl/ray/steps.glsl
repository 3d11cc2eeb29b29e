//: How many samples a ray takes. Section: count.
uniform float u_step_mm;
//#section count
float length_mm = part * length(ray);
// Rounding may make a ray longer than whole steps, often along an axis: it gets no more samples for that.
float steps = length_mm / u_step_mm;
float count = ceil(max(steps - 0.001, min(steps, 0.001)));
