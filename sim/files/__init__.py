"""What data files share: strict schemas, frames, errors that say where."""
