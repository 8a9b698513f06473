"""The inverse of the term table: coefficients and their covariance from runs, stage by stage."""
