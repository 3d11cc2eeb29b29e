"""Proxy geometry."""
