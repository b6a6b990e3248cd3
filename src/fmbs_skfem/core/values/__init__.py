"""What values may be: quantities, expressions, tables, fields of declarations."""

__all__ = ["expressions"]
