"""The process of the command line: signals that end it, and the parent that watches it."""
