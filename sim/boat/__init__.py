"""A vehicle and its coefficients: term table, vehicle file, tables, rows of a version."""
