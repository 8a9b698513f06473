"""Linear waves and their loads, along the boat's path."""
