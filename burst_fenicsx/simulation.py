"""A burst under way: steps, the ledger, outputs, checkpoints and the snapshot."""

from __future__ import annotations

import hashlib
import logging
import time as clock
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from burst_fenicsx.assembled import AssembledBurst
from burst_fenicsx.files.checkpoint import read_checkpoint, write_checkpoint
from burst_fenicsx.files.output import Background, TimeSeries
from burst_fenicsx.files.revolve import revolution, write_revolved
from burst_fenicsx.files.snapshot import EndState, write_snapshot
from burst_fenicsx.kernels.constants import CHECK_INTERVAL, LARGEST_CONTACT_ERROR
from burst_fenicsx.mechanics.erosion import erode_at_end
from burst_fenicsx.meshing.placement import FACING, frame
from burst_fenicsx.problem import BurstSettings, Mirror, Round
from burst_fenicsx.records.gather import output_fields, snapshot_fields
from burst_fenicsx.records.measures import RoundMeasures
from burst_fenicsx.records.summary import Clocks, burst_summary, round_records
from burst_fenicsx.symmetry.completion import POINTS, STRESSES, VECTORS, turned_stress
from fragfield_base.interruption import Interruption

if TYPE_CHECKING:
    from pathlib import Path


_log = logging.getLogger(__name__)

_HISTORY_INTERVAL = 1e-6
_PROGRESS_SECONDS = 0.2
_Arrays = dict[str, np.ndarray]
# Checkpoints are kept where the state is checked, the first at once, of a meridian after as long, and then not more
# often than this: no more than that is lost.
_CHECKPOINT_SECONDS = 30.0


@dataclass(frozen=True)
class BurstProgress:
    """Progress of the burst. Times in s; macro steps; `seconds_left` is estimated from the rate so far.

    `end_time` and `seconds_left` are None while no end is foreseen.
    """

    time: float
    end_time: float | None
    step: int
    steps_per_second: float
    cell_steps_per_second: float
    time_step: float
    seconds_left: float | None


@dataclass(frozen=True)
class BurstResult:
    """What the burst gave.

    Attributes
    ----------
    summary : the "burst" part of summary.json.
    rounds : speeds and diameters along each round at the end.
    history : the ledger's entries by name.
    end : what the snapshot holds; of rank 0.
    """

    summary: dict[str, Any]
    rounds: list[RoundMeasures]
    history: dict[str, np.ndarray]
    end: EndState | None


class Simulation(AssembledBurst):
    """A burst under way; `simulate` drives it.

    Attributes
    ----------
    writes_series : whether burst.xdmf and what else is for visualisation alone are written; not without a folder.
    acceleration_complete : when it was (s).
    """

    def __init__(
        self,
        rounds: Sequence[Round],
        settings: BurstSettings,
        out_dir: Path | None,
        comm: MPI.Comm,
        provenance: dict[str, str],
        on_progress: Callable[[BurstProgress], None] | None = None,
        *,
        keep_mesh: bool = False,
    ) -> None:
        self.clocks = Clocks()
        super().__init__(rounds, settings, comm, keep_mesh=keep_mesh)
        self.out_dir = out_dir
        self.writes_series = out_dir is not None
        self.provenance = provenance
        self.on_progress = on_progress
        self._series: TimeSeries | None = None
        # States in memory besides the burst's own: those of a meridian are small, and computed faster than written.
        self._writing = Background(16 if self.geometry.upright else 1)
        self._output_at = -np.inf
        self._resumed_at: float | None = None
        self._checkpoint_at = self.clocks.start if self.geometry.upright else -np.inf
        self.first_step_at, self.first_cell_step_at = 0, 0
        self.acceleration_complete: float | None = None
        self._before: tuple[float, _Arrays, _Arrays] | None = None  # time and fields before a step beyond an output

    @property
    def checkpoint_path(self) -> Path:
        """Where the state is kept while the burst runs."""
        assert self.out_dir is not None
        return self.out_dir / "checkpoint.h5"

    @property
    def key(self) -> str:
        """Names the mesh and the settings, for the checkpoint."""
        text = repr((self.settings, self.rounds)).encode()
        return f"{len(self.mesh.cells)} cells, {hashlib.sha256(text).hexdigest()[:16]}"

    def resume(self) -> None:
        """Go on from the checkpoint."""
        records = read_checkpoint(self.checkpoint_path, self.solver, self.key, self.provenance)
        self.interpenetration.largest = records["passed_through"]
        self.exposures.values[:] = records["exposure"]
        self.acceleration.restore(records["acceleration"], records["touched"])
        complete = float(records["acceleration_complete"])
        self.acceleration_complete = complete if np.isfinite(complete) else None
        self._resumed_at = self.solver.time
        self.first_step_at, self.first_cell_step_at = self.solver.steps, self.solver.cell_steps

    def run(self) -> None:
        """Step until the end, taking the ledger, outputs and checkpoints on the way; then all states are written."""
        with Interruption(self.comm) as interruption:
            self._run(interruption)
        self._writing.wait()

    def _run(self, interruption: Interruption) -> None:
        self._open_series()
        solver, settings = self.solver, self.settings
        end = settings.end_time if settings.end_time is not None else settings.time_limit
        entries = self.ledger.entries
        history = entries[-1].time + _HISTORY_INTERVAL if entries else 0.0
        # Of a resumed burst, or one that begins with its first ignition, not the first.
        self._next_output = _multiple_from(solver.time, settings.output_interval)
        check = _multiple_from(solver.time, CHECK_INTERVAL)
        until = min(end, self._expected_end())
        self.clocks.first_step = clock.perf_counter() - self.clocks.start
        began = clock.perf_counter()
        try:
            while True:
                finished = solver.time >= end * (1.0 - 1e-12) or self._ended_by_acceleration
                recorded = bool(entries) and entries[-1].time >= solver.time  # by the run that was interrupted here
                if (solver.time >= min(history, until) or finished) and not recorded:
                    self._record()
                    history = solver.time + _HISTORY_INTERVAL
                    until = min(end, self._expected_end())
                    finished = finished or self._ended_by_acceleration
                if finished:
                    solver.bring_velocities()
                    erode_at_end(self.fields)
                self._write_outputs(finished=finished)
                if solver.time >= check * (1.0 - 1e-12) or finished:
                    self._check()
                    check += CHECK_INTERVAL
                self._report_progress(until, began)
                # Here, between two steps, and nowhere else the state is one that a run can go on from.
                if solver.time > 0.0 and interruption.asked():
                    self._write_checkpoint()
                    self.comm.Barrier()  # a rank that left would end the others, and the first one is still writing
                    raise KeyboardInterrupt
                if finished:
                    break
                solver.step(until, self._keep_before if self.writes_series else None)
                self.exposures.update(solver.time, solver.time_step)
        except BaseException:
            self._writing.close()
            raise
        finally:
            self.clocks.stepping += clock.perf_counter() - began

    def _record(self) -> None:
        """Take the ledger and the casings' energies, and note when their acceleration is complete; collective."""
        time = self.solver.time
        diameter = self.measures.outer_diameter(self.measures.outer_radii())
        self.ledger.record(self.fields, time, self.solver.time_step, diameter, self.contact)
        radii = self.leakage.mean_radii(self.leakage.radii(self.fields.nodes.position), len(self.rounds))
        ignition = self.fields.charge.ignition_time
        ignited = np.array([np.count_nonzero(ignition[cells] <= time) for cells in self.fields.charge_cells])
        ignited = self.comm.allreduce(ignited) if self.comm.size > 1 else ignited
        if self.contact.collisions is not None:
            self.acceleration.touched |= self.contact.collisions.touching_rounds()
        self.acceleration.record(time, self.ledger.kinetic_casings, radii, ignited > 0)
        if self.acceleration_complete is None and self._burnt_out() and self.acceleration.end() <= time:
            self.acceleration_complete = time

    def _expected_end(self) -> float:
        return self.acceleration.end() if self.settings.end_time is None and self._burnt_out() else np.inf

    @property
    def _ended_by_acceleration(self) -> bool:
        return self.settings.end_time is None and self.acceleration_complete is not None

    def _burnt_out(self) -> bool:
        """Whether all initiated charges have burnt out, and no shock is about to initiate another; collective.

        A charge that nothing has initiated by then is not waited for.
        """
        burning, initiation = self.solver.burning, self.initiation
        pressed = initiation is not None and initiation.is_pressed()
        return 0.0 < burning.end <= self.solver.time and not pressed

    def _open_series(self) -> None:
        if self.comm.rank == 0 and self.out_dir is not None and self.writes_series:
            self._series = TimeSeries(
                self.out_dir / "burst", self.completion.cells, self.provenance, resume_at=self._resumed_at
            )
            self._output_at = max(self._series.times, default=-np.inf)

    def _check(self) -> None:
        self.check_state()
        due = self.comm.bcast(clock.perf_counter() - self._checkpoint_at >= _CHECKPOINT_SECONDS)  # by rank 0's clock
        if self.solver.time > 0.0 and due:
            self._write_checkpoint()

    def _keep_before(self, time: float) -> None:
        """Keep the fields before a step to a time (s) beyond the next output; collective."""
        if time > self._next_output:
            self._before = self.solver.time, *self._output_fields()

    def _write_outputs(self, *, finished: bool) -> None:
        """Write the states that are due, between two steps along the line, and the last one as it is; collective."""
        time, interval = self.solver.time, self.settings.output_interval
        due = time >= self._next_output * (1.0 - 1e-12)
        if not self.writes_series or not (due or finished):
            self._next_output += interval if due else 0.0
            return
        now = self._output_fields()
        while self._next_output <= time * (1.0 + 1e-12):
            if self._before is None or self._next_output >= time * (1.0 - 1e-12):
                self._write_state(time, *now)
            else:
                since, *before = self._before
                weight = (self._next_output - since) / (time - since)
                self._write_state(self._next_output, *map(partial(_between, weight), before, now))
            self._next_output += interval
        self._before = None
        if finished:
            self._write_state(time, *now)

    def _output_fields(self) -> tuple[_Arrays, _Arrays]:
        force = self.contact.force if self.contact.exists else None
        return output_fields(self.fields, force, with_nodal_stress=self.settings.nodal_stress)

    def _write_state(self, time: float, points: _Arrays, cells: _Arrays) -> None:
        """Begin to write a state to the series, unless it is there; collective."""
        self._writing.make_room()
        if self._series is not None and time > self._output_at:
            points, cells = dict(points), dict(cells)
            if self.geometry.upright:
                _carry((points, cells), FACING)
            self._output_at = time
            self._writing.begin(partial(self._write_series, self._series, time, points, cells))

    def _finish_series(self) -> None:
        self._writing.wait()
        if self._series is not None:
            self._series.flush()

    def _write_series(
        self, series: TimeSeries, time: float, points: dict[str, np.ndarray], cells: dict[str, np.ndarray]
    ) -> None:
        """Write a state of the part that is computed, as one of the whole; no one else has the arrays."""
        points, cells = series.rounded(points), series.rounded(cells)
        points, cells = self.completion.point_fields(points), self.completion.cell_fields(cells)
        series.write(time, points.pop("position"), point_data=points, cell_data=cells)

    def _to_world(self, *groups: dict[str, np.ndarray]) -> None:
        if self.geometry.upright:
            _carry(groups, frame(self.rounds[0].axis), self.rounds[0].position)

    def _write_checkpoint(self) -> None:
        if self.out_dir is None:
            return
        self._finish_series()  # whoever resumes from here needs the outputs before it
        self._checkpoint_at = clock.perf_counter()
        records = {
            "passed_through": self.interpenetration.largest,
            "acceleration": self.acceleration.array(),
            "touched": self.acceleration.touched,
            "acceleration_complete": np.array(self.acceleration_complete or np.nan),
            "exposure": self.exposures.values,
        }
        write_checkpoint(self.checkpoint_path, self.solver, self.provenance, self.key, records)

    def _report_progress(self, end: float, began: float) -> None:
        now = clock.perf_counter()
        if self.on_progress is None or self.comm.rank != 0 or now - self.clocks.last_progress < _PROGRESS_SECONDS:
            return
        self.clocks.last_progress = now
        solver = self.solver
        elapsed = max(now - began, 1e-9)
        rate = (solver.steps - self.first_step_at) / elapsed
        foreseen = self.settings.end_time is not None or end < self.settings.time_limit
        known = foreseen and solver.time_step > 0.0 and rate > 0.0
        left = (end - solver.time) / solver.time_step / rate if known else None
        self.on_progress(
            BurstProgress(
                time=solver.time,
                end_time=end if foreseen else None,
                step=solver.steps,
                steps_per_second=rate,
                cell_steps_per_second=self.comm.size * (solver.cell_steps - self.first_cell_step_at) / elapsed,
                time_step=solver.time_step,
                seconds_left=left,
            )
        )

    def finish(self) -> BurstResult:
        """Write the snapshot, last of all files, and give the summary, of all rounds; collective.

        Its velocities are those that fragments start with: those at the end times `speed_factors`.
        """
        whole, factors = self.completion, self.speed_factors()
        along = whole.measures(
            [item.times(factor) for item, factor in zip(self.measures.rounds(), factors, strict=True)]
        )
        masses, speeds = self.measures.segment_masses_and_speeds()
        speeds = [factor * speed for factor, speed in zip(factors, speeds, strict=True)]
        records = whole.records(round_records(self, masses, speeds))
        nodes, cells = snapshot_fields(self.fields)
        if nodes:
            of_round = np.empty(len(self.mesh.nodes), dtype=np.int64)
            of_round[self.mesh.cells] = self.mesh.round[:, None]
            nodes["velocity"] *= factors[of_round][:, None]
        self._to_world(nodes)
        history = whole.history(self.ledger.columns())
        charge_masses = [record.charge_mass for record in records]
        summary = burst_summary(
            self, along, charge_masses, self.clocks, self.first_cell_step_at, self.acceleration_complete
        )
        self.interpenetration.log_result(summary["contact"], summary["folded_casing_mass"])
        self._warn_of_contact()
        if self.settings.end_time is None and self.acceleration_complete is None and self.comm.rank == 0:
            _log.warning(
                "the casings still accelerate or collide at burst.time_limit = %g s: fragments start with the speeds "
                "of that time",
                self.settings.time_limit,
                extra={"code": "no_end"},
            )
        if self.comm.rank == 0 and self.geometry.upright and self.writes_series:
            self._write_revolved()
        self._finish_series()
        self._writing.close()
        end = None
        if self.comm.rank == 0:
            names = whole.names
            end = EndState(
                self.solver.time,
                whole.point_fields(nodes),
                {"nodes": whole.cells, **names, "part": names["part"].astype(np.uint8), **whole.cell_fields(cells)},
                records,
                along,
                history,
                [plane for plane in self._given.planes if isinstance(plane, Mirror)],
                self.geometry.name,
            )
            if self.out_dir is not None:
                write_snapshot(self.out_dir / "burst_snapshot.h5", end, self.provenance)
        return BurstResult(summary, along, history, end)

    def speed_factors(self) -> np.ndarray:
        """Speeds that fragments start with over those at the end (rounds,); 1 of an end that was given, never less."""
        left = self.acceleration.left() if self._ended_by_acceleration else np.zeros(len(self.rounds))
        return np.sqrt(1.0 + np.maximum(np.nan_to_num(left), 0.0))

    def _warn_of_contact(self) -> None:
        last = self.ledger.entries[-1]
        if last.contact_error > LARGEST_CONTACT_ERROR and self.comm.rank == 0:
            _log.warning(
                "contact has %s %.2g %% of the products' work; %g %% is the aim",
                "made" if last.contact_gain > 0.0 else "lost",
                100.0 * last.contact_error,
                100.0 * LARGEST_CONTACT_ERROR,
                extra={"code": "contact_energy"},
            )

    def _write_revolved(self) -> None:
        points, cells = output_fields(self.fields, self.contact.force if self.contact.exists else None)
        start = {"reference": self.mesh.nodes}
        self._to_world(points, cells, start)
        swept = revolution(start["reference"], self.mesh.cells, self.rounds[0].position, self.rounds[0].axis)
        assert self.out_dir is not None  # it writes the series
        path = self.out_dir / "burst_revolved"
        write_revolved(path, swept, self.solver.time, points.pop("position"), points, cells, self.provenance)


def _carry(groups: Sequence[_Arrays], axes: np.ndarray, position: Sequence[float] = (0.0, 0.0, 0.0)) -> None:
    """Carry fields from an upright round's own frame to one with these axes (rows) and position (m) of its base."""
    for fields in groups:
        for name, values in fields.items():
            if name in POINTS:
                fields[name] = values @ axes + np.asarray(position)
            elif name in STRESSES:
                fields[name] = turned_stress(values, axes.T)
            elif name in VECTORS:
                fields[name] = values @ axes


def _multiple_from(time: float, interval: float) -> float:
    """Smallest multiple of the interval that lies beyond the time, or 0 at time 0 (s)."""
    return float(interval * np.ceil(time / interval * (1.0 + 1e-9)))


def _between(weight: float, before: _Arrays, after: _Arrays) -> _Arrays:
    """Fields by name on the line from those before a step to those after it; what counts or marks is that after it."""
    return {
        name: (1.0 - weight) * before[name] + weight * values if values.dtype.kind == "f" else values
        for name, values in after.items()
    }
