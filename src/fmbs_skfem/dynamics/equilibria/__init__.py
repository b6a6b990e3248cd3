"""Equilibria: load steps, paths by arc length."""
