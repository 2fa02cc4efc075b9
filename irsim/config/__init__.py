"""Typed YAML that knows no scene: kinds and families, quantities, places of errors, overrides."""
