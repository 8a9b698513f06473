"""Every key of the files a user writes, from the models that check them: JSON schemas and reference tables."""
