"""The command line of irsim."""
