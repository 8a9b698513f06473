"""A test matrix as CFD cases: surface checked, cases written, progress told, output named to the fit."""
