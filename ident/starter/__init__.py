"""A commented boat, campaign, case, trial and calibration to start from; they fit and fly as they are."""
