"""What the plan decides, as records, and what several decisions ask: room on the device, pictures of sampled rays."""
