"""Estimates by named methods, from geometry and the campaign's own runs."""
