"""Records of the plan's decisions, and shared helpers: room on the device, pictures of sampled rays."""
