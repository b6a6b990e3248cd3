"""Example 2 of Hou, Liu, Hu (2020), doi 10.1016/j.cma.2019.112690, a thousand times: other Young's modulus and diameter each time.

A few full runs train one reduced model for the whole box, which is saved; the sweep runs its members on all cores. A sweep that was
stopped goes on when it is called again. Writes sweep.csv, sweep.h5 and figures into the folder.
"""

from __future__ import annotations

import sys
from pathlib import Path

from fmbs_skfem import scenes
from fmbs_skfem.families import greedy, members, parametric_model, prediction, sweeps, training
from fmbs_skfem.reduction import Points, body_level, parameters
from fmbs_skfem.reduction.full_runs import TrainingTask
from fmbs_skfem.reduction.plan import Plan
from fmbs_skfem.results import plots, sweep_files, sweep_plots

SCENE = Path(__file__).resolve().parent / "pendulum_family.yaml"


def train(
    path: Path, duration: float | None, cells: int | None, full_runs: int
) -> parametric_model.ParametricModel:
    """The reduced model over E and d; gravity stays as the scene has it."""
    known, family = scenes.family(scenes.read(SCENE), cells=cells, duration=duration)
    box = tuple(own for own in known if own.name in ("E", "d"))
    nominal = family(parameters.completed(box, {}))
    plan = Plan(body_level(nominal.system), 1e-12, hyper=Points())
    task = TrainingTask(family, box, plan, interval=min(5e-3, nominal.duration / 20))
    search = training.search(box, parameters.grid(box, 21), parameters.grid(box, 3))
    found = training.train(task, search, greedy.Options(iterations=full_runs, max_samples=20))
    rom = parametric_model.ParametricModel(
        found.model.parametric, {"scene": SCENE.stem, prediction.KEY: prediction.record(found)}
    )
    parametric_model.save(rom, path)
    return rom


def main(
    folder: Path = Path("sweep-pendulum"),
    count: int = 1000,
    duration: float | None = None,
    cells: int | None = None,
    full_runs: int = 5,
    options: sweeps.SweepOptions | None = None,
) -> dict[str, float]:
    """Members, cost, the largest error predicted and the range of the lowest position of C [m]."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "pendulum.h5"
    rom = parametric_model.load(path) if path.exists() else train(path, duration, cells, full_runs)
    box = rom.model.parameters
    names, points = [own.name for own in box], parameters.sobol(box, count)

    records = sweep_files.read_settled(folder, points, names)

    def keep(record: sweeps.Record) -> None:
        sweep_files.write(folder, record)
        records[record.number] = record

    task = members.ModelTask(str(path.resolve()))
    outcome = sweeps.run(task, names, points, keep, options, skip=tuple(records))

    table = sweep_files.collect(box, points, records)
    sweep_files.write_csv(table, folder / sweep_files.CSV)
    sweep_files.write_hdf5(table, folder / sweep_files.HDF5)
    for rule in (sweep_plots.response, sweep_plots.scatter_matrix, sweep_plots.fan):
        plots.save(rule(table, outputs=["C_x", "C_y", "C_z"]), folder / f"{rule.__name__}.png")

    predict = prediction.predictor(rom)
    errors = [predict(parameters.named(box, row)).error for row in points] if predict else []
    lowest = sweep_files.extremes(table, "C_z")["min"]
    return {
        "members": sum(status is sweeps.Status.OK for status in table.status),
        "wall_s": outcome.wall_s,
        "cpu_s": outcome.cpu_s,
        "predicted_error": max(errors, default=float("nan")),
        "lowest_min": float(lowest.min()),
        "lowest_max": float(lowest.max()),
    }


if __name__ == "__main__":
    print(main(*map(Path, sys.argv[1:2])))
