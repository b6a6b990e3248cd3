"""Reduced spaces: modes of a component, what they keep of constraints, Galerkin projection."""
