"""Where files are kept: run folders, locks, saved tares, logs that a user names."""
