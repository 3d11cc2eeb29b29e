"""A package on disk: drafts, files, locks, publishing, and reading from a folder or a single file."""
