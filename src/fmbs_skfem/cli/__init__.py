"""The command line: commands, their options, what is printed.

Bytecode is looked after here: `cli.main` and all that it loads are imported behind it.
"""

from ..core import bytecode

bytecode.keep()
