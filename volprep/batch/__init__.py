"""Many scans: jobs, a ledger of what became of each, workers that may die, and a page of all."""
