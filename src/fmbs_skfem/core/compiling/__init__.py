"""Compiled functions: structs, addresses, caches, symbols."""

__all__ = ["jit", "lapack"]
