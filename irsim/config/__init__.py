"""Typed YAML, independent of scenes: kinds and families, quantities, error messages with places, overrides."""
