"""The user's request: a scene, the class of devices, transfer functions and their presets."""
