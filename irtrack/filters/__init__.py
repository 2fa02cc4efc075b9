"""How trackers carry a state through time: motion models, resampling, the Kalman filter."""
