//: What a ray caster that begins at proxy geometry gets: v_entry, where the pixel's ray meets it, box millimetres.
$VARYING_IN vec3 v_entry;
// What rounds, and the resolution of the depth buffer, is less.
const float ENTRY_MARGIN_MM = $ENTRY_MARGIN_MM;
