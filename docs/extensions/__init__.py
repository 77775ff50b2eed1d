"""What the site writes of the program when it is built: the gallery of problems, and the reference of its own data."""
