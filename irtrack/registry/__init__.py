"""Trackers by name, with their parameters and the digest of their code."""
