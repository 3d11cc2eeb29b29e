"""OpenVDB."""
