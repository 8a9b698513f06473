"""The fewest further runs that give every term a wanted standard error."""
