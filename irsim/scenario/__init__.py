"""The scenario: model, loading, severities, variation, placement of occluders."""
