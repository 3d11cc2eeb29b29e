"""What a picture costs a device: bytes to upload, and memory."""
