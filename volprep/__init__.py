"""Stages, planner, reference renderer, truth and reports of volprep."""
