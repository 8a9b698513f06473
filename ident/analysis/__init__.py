"""Linear derivatives and stability of a version."""
