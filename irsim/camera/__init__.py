"""The camera: optics after the lens, detector, noise, and automatic gain control."""
