"""What the commands do: modules that are imported when their command runs, with all that it needs."""
