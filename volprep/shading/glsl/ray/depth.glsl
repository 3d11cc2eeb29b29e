//: Fragment shader of the first pass over proxy geometry: depth alone, so that the second pass runs once for a pixel.
//#part dialect
void main() {
  $PICTURE = vec4(0.0);
}
