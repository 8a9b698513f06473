"""Captive campaigns read: files of any laboratory to one run table in the program's frame and SI."""
