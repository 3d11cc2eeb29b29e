//: One sample, in the loop. MEDIUM is the colour and the extinction of the segment whose middle is i. Slots: light
//: changes its colour; sample adds it to the ray; stop may leave the loop.
vec4 medium = $MEDIUM;
//#part light
//#part sample
//#part stop
