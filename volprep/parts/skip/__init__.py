"""Empty-space skipping: which blocks show nothing, and tables that let rays jump over them."""
