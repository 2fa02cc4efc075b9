"""Registry of trackers: the table of names and `make` (`table`), their configuration and code hash (`identity`)."""
