"""Geometry and drawing: projection, camera pose, exact polygon coverage, sprites, random fields, vegetation."""
