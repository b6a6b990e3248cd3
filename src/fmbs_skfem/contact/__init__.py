"""Contact: points, beams and plates against shapes, beams against beams, corners of boxes against
plates; with friction.
"""

from . import beams, contacts, states

__all__ = ["beams", "contacts", "states"]
