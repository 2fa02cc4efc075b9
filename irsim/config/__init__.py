"""Typed YAML, independent of scenes: kinds and families, quantities, error messages with positions in the file,
overrides."""
