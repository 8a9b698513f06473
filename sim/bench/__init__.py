"""Speed of the simulator beside plain NumPy."""
