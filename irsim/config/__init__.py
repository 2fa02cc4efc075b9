"""Typed YAML that knows no scene: kinds and families, quantities, error messages with places, overrides."""
