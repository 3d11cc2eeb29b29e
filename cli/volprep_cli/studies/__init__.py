"""The studies of `volprep study`, one file for each."""
