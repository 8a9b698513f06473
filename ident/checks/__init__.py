"""Quality checks of a campaign: what is wrong with the runs, with evidence and remedy."""
