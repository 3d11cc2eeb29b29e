"""What light that is computed once costs in pictures, beside path tracing: scans, transfer functions, decibels."""
