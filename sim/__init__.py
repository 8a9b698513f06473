"""Six-degree-of-freedom submarine simulator driven by a tabulated coefficient database."""
