"""Scenes: YAML files become systems. In data-flow order: text -> Scene -> bodies, joints, loads ->
System, or a family of them.
"""

from .family import family
from .reading import loads, read
from .schema import Scene, json_schema
from .yamlfile import where

__all__ = ["read", "loads", "Scene", "json_schema", "where", "family"]
