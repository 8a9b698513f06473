"""Readers of each file format, one a file, in bounded memory."""
