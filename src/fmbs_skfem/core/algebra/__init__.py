"""Linear algebra: sparse factors, saddle points, ranks."""

__all__ = ["linalg", "ranks", "saddle"]
