"""Features in combination: a covering array has every pair of them; each row is within, or refused with a code."""
