//: Early ray termination, where the plan has an opacity cutoff: what is behind adds at most what is left.
if (transmittance < $LEAST_TRANSMITTANCE) {
  break;
}
