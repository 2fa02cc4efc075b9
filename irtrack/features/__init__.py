"""Image features of trackers: windows, histograms, gradients, background models, correlation, mean shift, flow."""
