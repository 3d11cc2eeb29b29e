if (transmittance < $LEAST_TRANSMITTANCE) {
  break;
}
