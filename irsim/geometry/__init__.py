"""Directions and pixels, the camera pose, polygons, sprites and random fields."""
