"""Costs of a picture on a device: bytes to upload, and memory."""
