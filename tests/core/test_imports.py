"""Parts of NumPy that copies of its names do not load."""

from __future__ import annotations

import subprocess
import sys
from types import ModuleType

import numpy as np
import pytest

from fmbs_skfem.core import imports


def test_scipy_leaves_alone_what_numpy_loads_later() -> None:
    """And NumPy has it when somebody asks, as does the copy of its names."""
    code = (
        "import sys, fmbs_skfem, scipy.sparse\n"
        "assert not {'numpy.f2py', 'numpy.testing', 'numpy.ma'} & set(sys.modules)\n"
        "import numpy as np\n"
        "from scipy._lib.array_api_compat import numpy as copy\n"
        "assert copy.ma.masked is np.ma.masked\n"
        "np.testing.assert_allclose(1.0, 1.0)\n"
        "import numpy.f2py\n"
        "assert numpy.f2py is sys.modules['numpy.f2py'] is np.f2py\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_numpy_is_as_it_was_behind_a_copy(monkeypatch: pytest.MonkeyPatch) -> None:
    """What the copy imports of it stays, also where the copy fails."""
    parts = "char", "rec"
    for name in parts:
        monkeypatch.delitem(vars(np), name, raising=False)

    def copy(module: ModuleType) -> None:
        assert isinstance(np.rec, imports.Later)
        module.char = np.char  # type: ignore[attr-defined]
        np.rec = sys  # type: ignore[misc]
        raise OSError("a copy that fails")

    module = ModuleType("copy")
    with pytest.raises(OSError, match="copy"):
        imports.copy_later(copy, module)
    assert "char" not in vars(np)
    assert vars(np)["rec"] is sys
    assert module.char.upper("a") == "A"
