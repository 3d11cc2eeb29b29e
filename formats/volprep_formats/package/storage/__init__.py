"""A package on disk: drafts, whole files, locks, publishing, folders and single files read alike."""
