"""Classes of devices, one TOML file each. Users may name one of these or give the path of their own."""
