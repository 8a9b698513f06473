"""Multipliers of coefficient groups from free-running maneuvers, as a new version."""
