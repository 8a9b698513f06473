"""What is measured of a maneuver: ITTC and IMO metrics, seakeeping statistics."""
