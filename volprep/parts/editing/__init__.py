"""Transfer functions that users of an app may edit: joint histograms, and tables made from them."""
