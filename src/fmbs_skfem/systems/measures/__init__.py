"""Outputs: what is read of a system in a state."""
