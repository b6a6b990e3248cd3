"""Analyses of a scene, each a declaration of what it needs, computes and finds."""

from .analysis import Analysis, Form, History, States, StateTable, Work

__all__ = ["Analysis", "Form", "History", "States", "StateTable", "Work"]
