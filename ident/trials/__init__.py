"""Measured maneuvers: a user's own free-running records, read, checked, measured and reported."""
