"""The compiled right-hand side and the model it reads."""
