"""Studies of volprep itself: what choices cost and gain, hard cases, figures. Nothing below imports this room."""
