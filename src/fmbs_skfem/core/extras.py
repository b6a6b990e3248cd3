"""Extras: packages that only some commands need, installed by name.

pip install "fmbs_skfem[viz]"        plots, pictures, animations
pip install "fmbs_skfem[families]"   the Kriging surrogate of trainings over parameters
pip install "fmbs_skfem[symbols]"    forces by expressions of the state; laws, joints and forces of one's own
pip install "fmbs_skfem[all]"        all three
pip install "fmbs_skfem[cluster]"    sweeps over many machines, by dask
pip install "fmbs_skfem[pymor]"      systems as models of pyMOR
pip install "fmbs_skfem[fmu]"        zig, a C compiler, for FMUs with binaries of other machines
"""

from __future__ import annotations

from importlib.util import find_spec

from .errors import MissingFeature, say

PACKAGES = {
    "viz": ("matplotlib", "PIL", "pyvista"),
    "families": ("sklearn",),
    "symbols": ("sympy",),
    "pymor": ("pymor",),
    "cluster": ("dask", "distributed", "cryptography"),
    "fmu": ("ziglang",),
}


def missing(extra: str) -> list[str]:
    """The packages of an extra that are not there."""
    return [name for name in PACKAGES[extra] if find_spec(name) is None]


def there(extra: str) -> bool:
    """Whether an extra is installed."""
    return not missing(extra)


def install(extra: str) -> str:
    """The line that installs an extra."""
    return f'pip install "fmbs_skfem[{extra}]"'


def need(extra: str, where: str) -> None:
    """Raise MissingFeature, with the line that installs it, where a package of an extra is not
    there.
    """
    if lost := missing(extra):
        raise MissingFeature(
            say(
                where,
                f"the packages of the extra `{extra}`",
                f"no {', '.join(lost)}",
                install(extra),
            )
        )
