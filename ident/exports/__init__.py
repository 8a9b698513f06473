"""What is taken out of the program: flights as histories, in the formats of other tools."""
