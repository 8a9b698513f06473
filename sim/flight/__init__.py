"""Maneuver cases flown: commands, trim, events, the stepped plant."""
