"""What speaks against a motion, and why a solve failed."""
