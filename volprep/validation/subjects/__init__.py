"""What is judged: a package with its scan, drawn by the oracle."""
