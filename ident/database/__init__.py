"""Versions written and compared: rows, provenance, differences, exports."""
