"""One page on a version."""
