"""`python -m fmbs_skfem` is the command `fmbs`."""

from .cli.main import main

main(prog_name="fmbs")
