"""Filters of trackers: particle and Kalman filters, motion models, resampling, data association."""
