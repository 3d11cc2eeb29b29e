"""Volumes in notebooks: a widget around the custom element of formats/js, and the objects that it can show."""
