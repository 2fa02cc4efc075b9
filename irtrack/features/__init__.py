"""What trackers measure in a picture: windows, grey histograms, correlation, centroids."""
