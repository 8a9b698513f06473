"""Cases flown from a version and held against references."""
