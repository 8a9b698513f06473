"""Captive submarine tests to a versioned maneuvering-coefficient database."""

__version__ = "0.1.0"
