"""Tests of `fmbs_skfem.exports`."""
