"""Beams with torsion and shear, and the constants of their sections."""
