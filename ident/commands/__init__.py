"""The commands of the command line, by what they work on; they parse, and import what they need when run."""
