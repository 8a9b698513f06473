"""Time histories reduced: clocks, block means, standard errors, regression."""

# Standard deviation of a normal distribution over its median absolute deviation.
MAD_TO_SIGMA = 1.4826
