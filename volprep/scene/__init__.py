"""What a user asks for: a scene, the class of devices, transfer functions and their presets."""
