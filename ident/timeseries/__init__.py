"""Time histories reduced: clocks, block means, standard errors, regression."""
