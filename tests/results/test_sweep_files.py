"""Files of a sweep: records to the bit, tables with units, damage, full disks, sweeps that are
killed and go on.
"""

from __future__ import annotations

import csv
import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from fmbs_skfem.core.errors import CorruptFile, InputError, NoRoom
from fmbs_skfem.core.notices import Notice
from fmbs_skfem.core.storage import container
from fmbs_skfem.families import members
from fmbs_skfem.families.members import Member, MemberResult, Record, Status
from fmbs_skfem.reduction.parameters import Parameter, Scale
from fmbs_skfem.results import sweep_files

E = Parameter("E", 0.7e9, 1.3e9, unit="Pa")
D = Parameter("d", 8e-3, 12e-3, Scale.LOG, unit="m")
N = Parameter("n", 1.0, 2.0)
DATA = Path(__file__).parent / "data"
TIMES = np.linspace(0.0, 3.0, 7)
POINTS = np.array(
    [[1e9, 0.01, 1.5], [1.1e9, 0.011, 1.0], [0.7e9, 0.012, 2.0], [1.3e9, 0.1 + 0.2, 1 / 3]]
)


def history(k: int) -> np.ndarray:
    return (k + 1) * np.cos(TIMES) - k


def record(k: int) -> Record:
    """Members 0 and 3 ran, 1 failed, 2 was killed."""
    values = dict(zip(("E", "d", "n"), POINTS[k].tolist(), strict=True))
    if k == 1:
        return Record(
            k,
            values,
            Status.FAILED,
            "diverged",
            "t = 0.5 s: expected convergence,\n got none",
            0.25,
            0.5,
        )
    if k == 2:
        return Record(k, values, Status.KILLED, "killed", "its worker ended", wall_s=0.5)
    result = MemberResult(
        TIMES,
        {"C_z": history(k), "speed": TIMES**k},
        {"C_z": "", "speed": "m/s"},
        {"predicted error": 1e-5 * k},
    )
    return Record(
        k, values, Status.OK, cpu_s=0.1 * k, wall_s=0.2, result=result, notices=("mind the gap",)
    )


def place(folder: Path, number: int) -> Path:
    return folder / "members" / f"{number:06d}.h5"


def same(one: Record, other: Record) -> bool:
    if replace(one, result=None) != replace(other, result=None) or (one.result is None) is not (
        other.result is None
    ):
        return False
    if one.result is None or other.result is None:
        return True
    a, b = one.result, other.result
    histories = [(a.times, b.times), *zip(a.columns.values(), b.columns.values(), strict=True)]
    return (
        list(a.columns) == list(b.columns)
        and (a.units, a.numbers) == (b.units, b.numbers)
        and all(np.array_equal(x, y) for x, y in histories)
    )


@pytest.mark.parametrize("number", range(4))
def test_a_record_comes_back_to_the_bit(number: int, tmp_path: Path) -> None:
    sweep_files.write(tmp_path, record(number))
    path = tmp_path / "members" / f"{number:06d}.h5"
    assert same(sweep_files.read(tmp_path, number), record(number))
    assert [item.name for item in path.parent.iterdir()] == [path.name]


def test_any_damage_is_found(tmp_path: Path) -> None:
    """A flipped byte anywhere, and a file that is cut off."""
    sweep_files.write(tmp_path, record(3))
    path = place(tmp_path, 3)
    data = path.read_bytes()
    for k in (*range(0, len(data), len(data) // 200), container.HEADER - 1, len(data) - 1):
        path.write_bytes(data[:k] + bytes([data[k] ^ 0xFF]) + data[k + 1 :])
        with pytest.raises(CorruptFile, match="remove it and go on with --resume"):
            sweep_files.read(tmp_path, 3)
    for short in (data[: len(data) // 2], data[:-1], b""):
        path.write_bytes(short)
        with pytest.raises(CorruptFile, match=r"expected .*remove it and go on with --resume"):
            sweep_files.read(tmp_path, 3)


def test_extremes_between_instants_count(tmp_path: Path) -> None:
    """Those of a member that has some; what it says of another output, or smaller ones than the
    history's, change nothing.
    """
    known = record(0)
    assert known.result is not None
    more = {"C_z": np.array([-9.0, 0.5]), "speed": np.array([np.nan, np.nan])}
    sweep_files.write(tmp_path, replace(known, result=replace(known.result, extremes=more)))
    table = sweep_files.collect((E, D, N), POINTS, {0: sweep_files.read(tmp_path, 0), 3: record(3)})
    found = sweep_files.extremes(table, "C_z")
    assert (found["min"][0], found["max"][0], found["final"][0]) == (
        -9.0,
        history(0).max(),
        history(0)[-1],
    )
    assert (found["min"][3], found["max"][3]) == (history(3).min(), history(3).max())
    assert np.isnan(found["min"][1:3]).all()
    assert sweep_files.extremes(table, "speed")["max"][0] == 1.0


def test_a_flipped_number_is_found(tmp_path: Path) -> None:
    sweep_files.write(tmp_path, record(3))
    path = place(tmp_path, 3)
    data, wanted = bytearray(path.read_bytes()), history(3).tobytes()
    where = bytes(data).find(wanted)
    assert where > 0
    data[where + 8] ^= 1
    path.write_bytes(data)
    with pytest.raises(CorruptFile):
        sweep_files.read(tmp_path, 3)


def test_settled_members_are_those_of_these_points(tmp_path: Path) -> None:
    """A damaged record and one of another point count as missing, with a notice; a killed member
    without.
    """
    for k in range(4):
        sweep_files.write(tmp_path, record(k))
    names = ("E", "d", "n")
    assert sorted(sweep_files.read_settled(tmp_path, POINTS, names)) == [0, 1, 3]
    place(tmp_path, 1).write_bytes(b"none")
    with pytest.warns(Notice, match="000001.h5.*counts as missing"):
        assert sorted(sweep_files.read_settled(tmp_path, POINTS, names)) == [0, 3]
    place(tmp_path, 1).unlink()
    other = POINTS.copy()
    other[2, 0] *= 1 + 1e-15
    with pytest.warns(Notice, match="another sample"):
        assert sorted(sweep_files.read_settled(tmp_path, other, names)) == [0, 3]
    sweep_files.store_of(tmp_path).forget("")
    assert sweep_files.read_settled(tmp_path, POINTS, names) == {}


def test_members_without_an_end_of_their_own_are_missing(tmp_path: Path) -> None:
    """More time or memory may be there when a sweep goes on."""
    ends = (Status.OK, Status.TIMEOUT, Status.FAILED, Status.KILLED)
    for k, status in enumerate(ends):
        sweep_files.write(tmp_path, replace(record(k), status=status))
    assert sorted(sweep_files.read_settled(tmp_path, POINTS, ("E", "d", "n"))) == [0, 2]


def exhaust(values: Mapping[str, float]) -> MemberResult:
    """More than the addresses of a process: 1 EiB."""
    raise AssertionError(np.empty(1 << 60, dtype=np.int8))


def test_a_member_without_memory_is_missing(tmp_path: Path) -> None:
    found = members.run_member(exhaust, Member(0, record(0).values), None)
    assert (found.status, found.reason) == (Status.FAILED, "out of memory")
    assert "Unable to allocate" in found.message
    sweep_files.write(tmp_path, found)
    assert sweep_files.read_settled(tmp_path, POINTS, ("E", "d", "n")) == {}


def test_a_full_disk_loses_nothing(tmp_path: Path) -> None:
    """/dev/full takes no byte: ENOSPC as on a full disk."""
    sweep_files.write(tmp_path, record(0))
    (tmp_path / "members" / "000001.h5.part").symlink_to("/dev/full")
    with pytest.raises(
        NoRoom, match=r"000001\.h5: expected room on the disk.*no space left.*--resume"
    ):
        sweep_files.write(tmp_path, record(1))
    assert sorted(item.name for item in (tmp_path / "members").iterdir()) == ["000000.h5"]
    assert same(sweep_files.read(tmp_path, 0), record(0))


def test_a_folder_that_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "members").write_text("a file in the way")
    with pytest.raises(InputError, match="expected a place that can be written"):
        sweep_files.write(tmp_path, record(0))


def swept() -> sweep_files.Sweep:
    return sweep_files.collect((E, D, N), POINTS, {k: record(k) for k in (3, 0, 1)})


def test_the_table_has_units_and_extremes(tmp_path: Path) -> None:
    path = sweep_files.write_csv(swept(), tmp_path / "sweep.csv")
    with path.open(newline="") as file:
        head, *rows = csv.reader(file)
    assert head[:4] == ["member", "E [Pa]", "d [m]", "n"]
    assert head[4:10] == [
        "C_z min",
        "C_z max",
        "C_z final",
        "speed min [m/s]",
        "speed max [m/s]",
        "speed final [m/s]",
    ]
    assert head[10:] == ["predicted error", "status", "reason", "message", "cpu_s [s]"]
    assert [float(text) for text in rows[3][1:4]] == pytest.approx(POINTS[3], rel=1e-14)
    values = history(3)
    assert [float(text) for text in rows[3][4:7]] == pytest.approx(
        [values.min(), values.max(), values[-1]], rel=1e-14
    )
    assert [float(text) for text in rows[3][7:10]] == pytest.approx([0.0, 27.0, 27.0])
    assert rows[1][4:11] == [""] * 7
    assert rows[1][11:14] == ["failed", "diverged", "t = 0.5 s: expected convergence, got none"]
    assert [row[11] for row in rows] == ["ok", "failed", "missing", "ok"]


def test_the_histories_are_stored_with_units(tmp_path: Path) -> None:
    path = sweep_files.write_hdf5(swept(), tmp_path / "sweep.h5")
    with h5py.File(path) as file:
        assert list(file["parameters"].attrs["names"]) == ["E", "d", "n"]
        assert list(file["parameters"].attrs["units"]) == ["Pa", "m", ""]
        np.testing.assert_array_equal(file["parameters"], POINTS)
        np.testing.assert_array_equal(file["times"], TIMES)
        np.testing.assert_array_equal(file["histories/C_z"][3], history(3))
        assert np.isnan(file["histories/C_z"][1]).all()
        assert file["histories/speed"].attrs["unit"] == "m/s"
        assert [text.decode() for text in file["status"]] == ["ok", "failed", "missing", "ok"]
        assert file["numbers/predicted error"][3] == pytest.approx(3e-5)


def test_members_of_other_lengths_stand_side_by_side(tmp_path: Path) -> None:
    """Steps and durations may depend on parameters: short histories end with NaN, and every member
    has its times.
    """
    short = MemberResult(TIMES[:3] / 2, {"C_z": np.array([1.0, -2.0, 0.5])})
    table = sweep_files.collect(
        (E, D, N), POINTS, {0: record(0), 1: replace(record(0), number=1, result=short)}
    )
    found = sweep_files.extremes(table, "C_z")
    assert [found[kind][1] for kind in sweep_files.EXTREMES] == [-2.0, 1.0, 0.5]
    with h5py.File(sweep_files.write_hdf5(table, tmp_path / "sweep.h5")) as file:
        assert file["times"].shape == (4, 7)
        np.testing.assert_array_equal(file["times"][1, :3], TIMES[:3] / 2)
        assert np.isnan(file["times"][1, 3:]).all()


def test_a_sweep_without_any_result(tmp_path: Path) -> None:
    table = sweep_files.collect((E, D, N), POINTS, {1: record(1)})
    assert sweep_files.write_csv(table, tmp_path / "a.csv").read_text().count("missing") == 3
    with h5py.File(sweep_files.write_hdf5(table, tmp_path / "a.h5")) as file:
        assert file["parameters"].shape == (4, 3)


TABLED = [Parameter("E", 0.0, 1.0, unit="Pa"), Parameter("d", 0.0, 1.0, unit="m")]


def test_points_from_a_table(tmp_path: Path) -> None:
    """Units in the header; a table of results can be taken as it is."""
    path = tmp_path / "points.csv"
    path.write_text("d [mm],comment,E [GPa]\n8,a,0.7\n\n12,b,1.3\n")
    assert sweep_files.read_points(path, TABLED) == [
        {"d": 8 * 1e-3, "E": 0.7e9},
        {"d": 12 * 1e-3, "E": 1.3e9},
    ]
    results = sweep_files.write_csv(swept(), tmp_path / "sweep.csv")
    found = sweep_files.read_points(results, [*TABLED, Parameter("n", 0.0, 9.0)])
    np.testing.assert_allclose([list(row.values()) for row in found], POINTS, rtol=1e-14)


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("E [GPa]\n1\n", "a header with E, d"),
        ("", "no header"),
        ("E,d\n", "0 rows"),
        ("E,d\n1,x\n", "row 2: expected a number in column 2, got 'x'"),
        (
            "E;d\n1,5;2\n",
            "columns separated by commas, got semicolons in 'E;d'; write the file again as CSV with commas",
        ),
        ("E,d\n1,0,5\n", "row 2: expected 2 cells, one under each title, got 3"),
        ("E [mm],d\n1,1\n", r"column 'E': expected a pressure \[Pa\], got '1 mm'"),
        ("E,d,E\n1,1,2\n", "expected one of the columns E, d, E, got 'E' 2 times"),
        ("E,d\n1\n", "row 2: expected a number in column 2, got nothing"),
    ],
)
def test_bad_tables_of_points(text: str, match: str, tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=match):
        sweep_files.read_points(path, TABLED)
    with pytest.raises(InputError, match="a CSV file"):
        sweep_files.read_points(tmp_path / "none.csv", TABLED)


SLOW = """
import sys, time
from dataclasses import dataclass
from pathlib import Path
import numpy as np
from fmbs_skfem.families import sweeps
from fmbs_skfem.families.members import MemberResult
from fmbs_skfem.results import sweep_files

FREE = 8  # members that do not wait until the main process is gone

@dataclass(frozen=True)
class Slow:
    go: Path
    def prepare(self):
        return lambda values: self.one(values["E"])
    def one(self, value):
        while value >= FREE and not self.go.exists():
            time.sleep(0.01)
        return MemberResult(np.arange(3.0), {"y": value * np.arange(3.0)})

if __name__ == "__main__":
    folder, count = Path(sys.argv[1]), int(sys.argv[2])
    points = np.arange(float(count))[:, None]
    done = sweep_files.read_settled(folder, points, ["E"])
    print(len(done), flush=True)
    keep = lambda record: sweep_files.write(folder, record)
    outcome = sweeps.run(Slow(folder.parent / "go"), ["E"], points, keep, sweeps.SweepOptions(workers=2, batch=1e-9), done)
    print(sum(outcome.counts.values()))
"""


def test_a_killed_sweep_goes_on_with_what_is_missing(tmp_path: Path) -> None:
    """SIGKILL of the main process while members wait; its workers end too, and each member is
    computed once.
    """
    script, folder, count = tmp_path / "slow.py", tmp_path / "out", 40
    script.write_text(SLOW)
    command = [sys.executable, str(script), str(folder), str(count)]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, text=True, start_new_session=True
    ) as main:
        while len(list(folder.glob("members/*.h5"))) < 5:
            assert main.poll() is None
            time.sleep(0.02)
        os.kill(main.pid, signal.SIGKILL)
        main.wait()
    (tmp_path / "go").touch()
    there = {path.name: path.stat().st_mtime_ns for path in folder.glob("members/*.h5")}
    assert 5 <= len(there) < count
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.split() == [str(len(there)), str(count - len(there))]
    points = np.arange(float(count))[:, None]
    found = sweep_files.read_settled(folder, points, ["E"])
    assert sorted(found) == list(range(count))
    for k, one in found.items():
        assert one.result is not None, one.message
        np.testing.assert_array_equal(one.result.columns["y"], k * np.arange(3.0))
    assert all(
        (folder / "members" / name).stat().st_mtime_ns == stamp for name, stamp in there.items()
    )
    for _ in range(6000):  # the orphans notice within seconds
        if not alive(main.pid):
            break
        time.sleep(0.1)
    assert not alive(main.pid)


def alive(group: int) -> bool:
    """Whether processes of the session that this process began are left."""
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True
