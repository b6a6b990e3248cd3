"""The command line: commands, their options, what is printed.

What makes imports cost less is done here, before `cli.main` and all that it loads are imported.
"""

from ..core import bytecode, imports

bytecode.keep()
imports.prepare()
