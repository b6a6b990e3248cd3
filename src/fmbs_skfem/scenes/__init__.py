"""Scenes: YAML files become systems. In data-flow order: text -> Scene -> bodies, joints, loads -> System."""

from .reading import loads, read
from .schema import Scene, json_schema, where

__all__ = ["read", "loads", "Scene", "json_schema", "where"]
