"""What follows exactly from the scan: derived again, and compared with what the package holds."""
