"""What is stored, and what of it is valid when it is read."""
