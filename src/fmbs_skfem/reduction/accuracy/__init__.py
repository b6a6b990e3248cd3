"""Errors of reduced models, what they cost, and how sharp they have to be."""
