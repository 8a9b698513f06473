"""A campaign to a committed version."""
