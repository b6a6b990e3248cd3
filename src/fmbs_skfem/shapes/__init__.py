"""Lines and their meshes: files become points, points become curves, curves become tabulated basis functions.

meshes.read -> LineMesh -> curves.through -> curve -> line.fit in a line.BSpline or line.Hermite -> line.tabulate -> table.Table
"""

from . import meshes, curves, line, table  # isort: skip

__all__ = ["meshes", "curves", "line", "table"]
