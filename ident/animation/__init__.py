"""A maneuver as a film."""
