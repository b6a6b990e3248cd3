"""The page that computes an example without this package: it runs, and what it finds is what the
package finds.
"""

from __future__ import annotations

from typing import Any

import pytest

from . import pages

PAGE = "docs/theory/by_hand.md"
#: positions and modes to 1e-9; what enlarges the round-off of the others stands at the end of the
#: page
LARGEST = dict.fromkeys(("motion", "POD basis", "reduced motion", "hyper-reduced motion"), 1e-9) | {
    "velocities": 1e-8,
    "reactions": 1e-6,
    "ECSW weights": 1e-7,
}


@pytest.fixture(scope="module")
def known() -> dict[str, Any]:
    """What the blocks of the page leave behind, run one after the other where the page says."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(pages.ROOT)
        return pages.run(PAGE)


def test_the_page_is_read_in_an_evening() -> None:
    assert len((pages.ROOT / PAGE).read_text(encoding="utf-8").splitlines()) <= 500


def test_the_package_computes_what_is_computed_by_hand(known: dict[str, Any]) -> None:
    assert set(known["differences"]) == set(LARGEST)
    assert {
        name: found for name, found in known["differences"].items() if not found < LARGEST[name]
    } == {}
    assert 2 * known["elements"] > (known["weights"] > 0).sum() > 0


def test_motions_by_hand_keep_their_energy(known: dict[str, Any]) -> None:
    """Kinetic, strain and potential energy sum up to that of the start but for 1e-4 of the kinetic
    one: all rho_inf = 0.8 takes.
    """
    full, motion = known["full"], known["motion"]
    kinetic = 0.5 * ((motion.v @ full.M) * motion.v).sum(axis=1)
    strain = [full.w @ known["energy"](full.L @ q) for q in motion.q]
    balance = kinetic + strain + (motion.q - motion.q[0]) @ full.Q
    assert abs(balance[-1] - balance[0]) < 1e-4 * kinetic[-1]
