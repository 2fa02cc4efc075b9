"""Radiometry, atmosphere, turbulence and point spread functions."""
