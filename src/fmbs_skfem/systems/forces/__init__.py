"""Forces on probe rows: laws, expressions, springs, loads."""
