"""Joints: their constraint functions, which rows are independent, and what they leave free."""
