"""Times of pictures, and the samples of their rays."""
