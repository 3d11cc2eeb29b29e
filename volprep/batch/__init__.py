"""Batches of scans: jobs, a ledger of their outcomes, workers that may crash, and an overview page."""
