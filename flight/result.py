"""Result of a flight: one row for each fragment, one for each crossing, and how each flight ended."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.errors import InputError
from flight.rows import HITS, OBSTACLE_HITS, RICOCHETS, Status, Trajectories, to_pandas
from fragfield_base.errors import names_allowed

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import ArrayLike, NDArray

    from flight.fluence import Fluence
    from flight.integrate.job import FlightJob
    from flight.path import FlightPath
    from flight.scene.obstacles import Obstacle
    from flight.scene.targets import Witness

_MOST_DRAWN = 100  # paths of a figure
_ELSEWHERE = "path: this result was not flown here; needed: the result of flight.fly"


@dataclass(frozen=True, eq=False, repr=False)
class FlightResult:
    """The outcome of `flight.fly`.

    Attributes
    ----------
    landing : (n,) structured array of dtype `LANDING`
        The end of every fragment's flight, in the order flown: its first impact on the ground, or where it left, was
        stopped or ran out of time; and `last_*`, its last landing once it ricochets no more.
    hits : (h,) structured array of dtype `HITS`
        Every crossing of a witness surface before the first impact on the ground, by fragment and then time.
    trajectories : Trajectories
        Paths of the sample asked for (may be empty); `path` and `paths` give those of any fragment.
    witnesses : tuple
        The surfaces, in the order `hits["witness"]` counts.
    summary : dict
        Numbers and mass by status, steps, wall time, use of the drag table beyond its ends.
    contacts : structured array of dtype `flight.CONTACTS`, optional
        Every contact between fragments, by time, where `fly` was given a `Contact`.
    obstacles : tuple
        Walls, barricades and buildings, in the order `obstacle` counts.
    obstacle_hits : (o,) structured array of dtype `OBSTACLE_HITS`
        Every impact on an obstacle, by fragment and then time.
    fluence : flight.fluence.Fluence, optional
        Lengths of paths below a person's height, where `fly` was asked to count them.
    ricochet_hits : structured array of dtype `HITS`
        Crossings of witness surfaces after an impact on the ground.
    ricochets : structured array of dtype `RICOCHETS`
        Every impact on the ground, first to last, of the fragments that ricochet off it, by fragment and then time.
    job : FlightJob, optional
        By whom paths are flown again.
    """

    landing: NDArray[Any]
    hits: NDArray[Any]
    trajectories: Trajectories
    witnesses: tuple[Witness, ...]
    summary: dict[str, Any] = field(default_factory=dict)
    contacts: NDArray[Any] | None = None
    obstacles: tuple[Obstacle, ...] = ()
    obstacle_hits: NDArray[Any] = field(default_factory=lambda: np.zeros(0, dtype=OBSTACLE_HITS))
    fluence: Fluence | None = None
    ricochet_hits: NDArray[Any] = field(default_factory=lambda: np.zeros(0, dtype=HITS))
    ricochets: NDArray[Any] = field(default_factory=lambda: np.zeros(0, dtype=RICOCHETS))
    job: FlightJob | None = None

    def __repr__(self) -> str:
        return (
            f"<flight.FlightResult: {len(self.landed)} of {len(self.landing)} fragments landed, {len(self.hits)} hits>"
        )

    def __str__(self) -> str:
        lines = [f"{len(self.landing)} fragments flown, {len(self.landed)} landed"]
        ends = {
            status.name.lower().replace("_", " "): int((self.landing["status"] == status).sum()) for status in Status
        }
        others = [f"{number} {name}" for name, number in ends.items() if number and name != "landed"]
        lines += [f"  {', '.join(others)}"] if others else []
        if len(self.landed):
            farthest = max(self.landed["distance"].max(), self.ended["last_distance"].max(initial=0.0))
            lines.append(f"  farthest landing {farthest:.4g} m")
        for index, witness in enumerate(self.witnesses):
            lines.append(f"  witness {witness.name}: {int((self.hits['witness'] == index).sum())} hits")
        for index, obstacle in enumerate(self.obstacles):
            number = int((self.obstacle_hits["obstacle"] == index).sum())
            lines.append(f"  obstacle {obstacle.name}: {number} hits")
        return "\n".join(lines)

    @property
    def landed(self) -> NDArray[Any]:
        """Rows of `landing` whose fragment reached the ground."""
        return self.landing[self.landing["status"] == Status.LANDED]

    @property
    def ended(self) -> NDArray[Any]:
        """Rows of `landing` whose fragment came to rest on the ground."""
        return self.landing[self.landing["last_status"] == Status.LANDED]

    def paths(self, fragments: ArrayLike) -> Trajectories:
        """Paths of fragments by their rows, flown again: points of each from launch to its last landing."""
        if self.job is None:
            raise InputError(_ELSEWHERE)
        chosen, number = np.atleast_1d(np.asarray(fragments)), len(self.landing)
        inside = chosen.ndim == 1 and chosen.dtype.kind in "iu" and ((chosen >= 0) & (chosen < number)).all()
        if chosen.size and not inside:
            raise InputError(f"path: fragment is {fragments!r}, allowed: whole numbers from 0 to {number - 1}")
        return self.job.paths(chosen.astype(np.int64))

    def path(self, fragment: int) -> FlightPath:
        """The path of one fragment as a function of time: `result.path(0)(1.5)` is its position and velocity at 1.5 s.

        Raises InputError: there is no such fragment.
        """
        from flight.path import FlightPath

        points = self.paths(fragment)
        assert self.job is not None  # or there are no paths
        mass = float(self.landing["mass"][fragment])
        return FlightPath(mass, points.time, points.position, points.velocity, self.job.scene, self.job.origin)

    def plot(self, fragments: ArrayLike | None = None) -> Any:  # noqa: ANN401 - matplotlib need not be there
        """Draw paths from the side and from above, and where the fragments landed; matplotlib must be installed.

        `fragments` are the rows whose paths are drawn; by default up to a hundred, evenly over all. Returns the
        matplotlib figure.
        """
        if self.job is None:
            raise InputError(_ELSEWHERE)
        try:
            import matplotlib.pyplot as plt
        except ImportError:
            raise InputError("plot needs matplotlib, which is not installed: pip install matplotlib") from None
        number, origin = len(self.landing), self.job.origin
        evenly = np.unique(np.linspace(0, number - 1, min(_MOST_DRAWN, number)).astype(int))
        paths = self.paths(evenly if fragments is None else fragments)
        figure, (side, plan) = plt.subplots(2, 1, figsize=(8.0, 9.0), height_ratios=(1, 2), layout="constrained")
        for begin, end in zip(paths.start[:-1], paths.start[1:], strict=True):
            x, y, z = paths.position[begin:end].T
            side.plot(np.hypot(x - origin[0], y - origin[1]), z, color="0.5", linewidth=0.6)
            plan.plot(x, y, color="0.75", linewidth=0.5)
        for rows, name, label in ((self.landed, "position", "first impact"), (self.ended, "last_position", "at rest")):
            plan.plot(*rows[name][:, :2].T, ".", markersize=2.0, label=f"{label} ({len(rows)})")
        side.set(xlabel="distance (m)", ylabel="z (m)", title=f"{len(paths)} of {number} paths")
        plan.set(xlabel="x (m)", ylabel="y (m)", aspect="equal")
        plan.legend(loc="upper right")
        return figure

    def hits_on(self, witness: int | str) -> NDArray[Any]:
        """Crossings of one witness surface, by index or name; all there are, not copied, where it is the only one."""
        if isinstance(witness, str):
            names = [surface.name for surface in self.witnesses]
            if witness not in names:
                raise InputError(f"no witness {witness!r}{names_allowed(witness, names)}")
            if names.count(witness) > 1:
                raise InputError(f"{names.count(witness)} witnesses are called {witness!r}; ask by index")
            witness = names.index(witness)
        here = self.hits["witness"] == witness
        return self.hits if here.all() else self.hits[here]

    def by_face(self, energy: float = 79.0) -> list[dict[str, Any]]:
        """Hits on every obstacle by face; see `flight.scene.obstacles.count_by_face`."""
        from flight.scene.obstacles import count_by_face

        return count_by_face(self.obstacles, self.obstacle_hits, energy)

    def to_pandas(self) -> tuple[Any, Any]:
        """`landing` and `hits` as pandas frames (vectors become three columns); pandas must be installed."""
        return to_pandas(self.landing), to_pandas(self.hits)

    def write(self, folder: str | Path, provenance: Mapping[str, str] | None = None, *, csv: bool = True) -> list[Path]:
        """Write landing.h5, hits.h5, CSV copies and trajectories.xdmf into a folder; return the paths.

        With obstacles also obstacle_hits.h5, with contact between fragments contacts.h5.
        """
        from flight.files.hdf5 import csv_columns, write_table, write_trajectories
        from flight.files.text_tables import Labels, write_columns

        folder = Path(folder)
        stamp = dict(provenance or {})
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"{folder}: cannot be made a folder ({error})") from None
        names = [witness.name for witness in self.witnesses]
        tables: list[tuple[str, NDArray[Any], str, list[str], Labels | None]] = [
            ("landing", self.landing, "", [], None),
            ("hits", self.hits, "witness", names, None),
        ]
        if self.obstacles:
            first = np.cumsum([0, *(len(obstacle.faces) for obstacle in self.obstacles)])
            faces = [face for obstacle in self.obstacles for face in obstacle.faces]
            face = Labels(faces, first[self.obstacle_hits["obstacle"]] + self.obstacle_hits["face"])
            names = [obstacle.name for obstacle in self.obstacles]
            tables.append(("obstacle_hits", self.obstacle_hits, "obstacle", names, face))
        if self.contacts is not None:
            tables.append(("contacts", self.contacts, "", [], None))
        written = []
        for kind, table, what, names, labels in tables:
            written.append(write_table(table, folder / f"{kind}.h5", kind, names, stamp))
            if csv:
                columns = csv_columns(table, what, names, labels)
                path = folder / ("witness.csv" if kind == "hits" else f"{kind}.csv")
                written.append(write_columns(path, columns))
        if len(self.trajectories):
            written += write_trajectories(self.trajectories, self.landing, folder / "trajectories.xdmf", stamp)
        return written
