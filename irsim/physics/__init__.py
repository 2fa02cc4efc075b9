"""Radiometry, atmosphere, turbulence and the point spread function."""
