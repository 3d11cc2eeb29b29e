"""Everything that makes shader text: techniques and parts in GLSL, composed into programs."""
