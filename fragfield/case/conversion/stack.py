"""Expands a stack into its rounds: what [stack] allows, and the copies that it defines."""

from __future__ import annotations

from collections.abc import Container, Iterator, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fragfield.case.conversion.rounds import lift_to, outsides
from fragfield.case.conversion.surroundings import ground_height
from fragfield.case.faults import Fault, choice_faults
from fragfield.case.schema import CaseTable
from fragfield.case.tables.round import RoundTable, StackTable
from fragfield.errors import nearest
from fragfield_base.errors import show

Array = NDArray[np.float64]


_MOST_ROUNDS = 1000
_UPRIGHT = 1e-6  # sine of the angle to the vertical, or to the horizontal, up to which a round stands, or lies


def check_stack(case: CaseTable) -> Iterator[Fault]:
    """Faults of the table [stack], as lines `key: found ...; allowed: ...`."""
    stack = case.stack
    if stack is None:
        return
    faults = list(_template_faults(case, stack))
    if stack.size > _MOST_ROUNDS:
        faults.append(Fault("stack", f"found {stack.size} rounds; allowed: at most {_MOST_ROUNDS}"))
    yield from faults
    if not faults and not list(choice_faults(stack)):
        template = _template(case, stack)
        own = set(stacked_names(case))
        for number, entry in enumerate(case.round, start=1):
            if entry is not template and entry.name in own:
                yield Fault(
                    f"round[{number}].name",
                    f"found {show(entry.name)}, a name of the stack's own rounds; allowed: another",
                )
        yield from _ignited(case, stack)


def stacked_names(case: CaseTable) -> list[str]:
    """Names of the rounds that [stack] stands for."""
    assert case.stack is not None  # the caller's choice
    template = _template(case, case.stack)
    return [f"{template.name}_{number}" for number in range(1, case.stack.size + 1)]


def expanded(case: CaseTable, on_ground: Container[str] = ()) -> list[RoundTable]:
    """The rounds of a case whose rounds are resolved, with the stack's copies instead of the round they copy.

    `on_ground`: names of rounds that stand on the ground: copies do so each at its own x and y.
    """
    stack = case.stack
    if stack is None:
        return list(case.round)
    template = _template(case, stack)
    places = _places(case, template, stack)
    if stack.base == "ground" or (stack.base is None and template.name in on_ground):
        below = ground_height(case, *template.position[:2])
        places[:, 2] += [ground_height(case, x, y) - below for x, y in places[:, :2].tolist()]
    initiated = _initiated(case, stack)
    copies = []
    for index, (name, place) in enumerate(zip(stacked_names(case), places, strict=True)):
        delay = stack.delays[index] if stack.delays is not None else 0.0
        ignition = [
            point.model_copy(update={"delay": point.delay + delay})
            for point in template.ignition or []
            if index in initiated
        ]
        position = tuple(float(value) for value in place)
        copies.append(template.model_copy(update={"name": name, "position": position, "ignition": ignition}))
    at = case.round.index(template)
    return [*case.round[:at], *copies, *case.round[at + 1 :]]


def _places(case: CaseTable, template: RoundTable, stack: StackTable) -> Array:
    bodies = outsides(template, case)

    def pitch(direction: ArrayLike, gap: float) -> float:
        """From one round to the next along a direction: apart by the gap, and with meshes that do not overlap."""
        exact, outer = (float(np.ptp(body.reach(direction))) for body in bodies)
        return max(exact + gap, outer)

    layer_gap = stack.gap if stack.layer_gap is None else stack.layer_gap
    if stack.arrangement == "triangle":
        across = [1.0, 0.0, 0.0] if stands(template.axis) else across_horizontally(template.axis)
        offsets = triangle(stack.count or 2, pitch(across, stack.gap), template.axis)
    elif stack.arrangement == "row":
        offsets = row(stack.count or 1, pitch((1.0, 0.0, 0.0), stack.gap))
    else:
        gaps = (stack.gap, stack.gap, layer_gap)
        pitches = [pitch(direction, gap) for direction, gap in zip(np.eye(3).tolist(), gaps, strict=True)]
        offsets = pallet(stack.counts or (1, 1, 1), (pitches[0], pitches[1], pitches[2]))
    lift = lift_to(stack.base, template, case)
    return np.asarray(offsets + np.array(template.position) + [0.0, 0.0, lift])


def _template(case: CaseTable, stack: StackTable) -> RoundTable:
    return next(entry for entry in case.round if stack.round in (None, entry.name))


def _initiated(case: CaseTable, stack: StackTable) -> set[int]:
    if stack.initiated is None:
        return set(range(stack.size))
    names = stacked_names(case)
    return {names.index(one) if isinstance(one, str) else one - 1 for one in stack.initiated}


def _template_faults(case: CaseTable, stack: StackTable) -> Iterator[Fault]:
    names = [entry.name for entry in case.round]
    listed = ", ".join(show(name) for name in names)
    if stack.round is None and len(names) > 1:
        yield Fault("stack.round", f"missing; needed with several rounds: the name of the one to copy, one of {listed}")
    if stack.round is not None and names and stack.round not in names:
        yield Fault("stack.round", f"found {show(stack.round)}{nearest(stack.round, names)}; allowed: {listed}")
    if not names:
        yield Fault("stack.round", "found no table [[round]]; allowed: at least one, which the stack copies")
        return
    template = next((entry for entry in case.round if stack.round in (None, entry.name)), None)
    if template is None or stack.arrangement != "triangle" or not any(template.axis):
        return
    if not (stands(template.axis) or lies(template.axis)):
        yield Fault(
            "stack.arrangement",
            f'found "triangle" for rounds with axis = {list(template.axis)}; '
            "allowed: rounds that stand upright or lie level",
        )


def _ignited(case: CaseTable, stack: StackTable) -> Iterator[Fault]:
    template, names = _template(case, stack), stacked_names(case)
    if stack.delays is not None and len(stack.delays) != stack.size:
        yield Fault(
            "stack.delays", f"found {len(stack.delays)} values; allowed: one for each of the {stack.size} rounds"
        )
    if stack.initiated is None:
        return
    unknown = [one for one in stack.initiated if (one not in names if isinstance(one, str) else one > stack.size)]
    span = " to ".join(show(name) for name in dict.fromkeys((names[0], names[-1])))
    for one in unknown:
        near = f"{nearest(one, names)}; allowed: " if isinstance(one, str) else f"; allowed: 1 to {stack.size}, or "
        yield Fault("stack.initiated", f"found {show(one)}{near}{span}")
    if unknown:
        return
    initiated = _initiated(case, stack)
    if template.ignition is not None and not template.ignition:
        yield Fault("stack.initiated", f'found, but round "{template.name}" has no ignition point that they could have')
    if len(initiated) < stack.size and template.initiation is None:
        yield Fault(
            "stack.initiated",
            f'found {len(initiated)} of {stack.size} rounds; the others need round "{template.name}" to have '
            'initiation = { pressure = "5 GPa", duration = "0.2 us" }, by which the shock initiates them',
        )
    for index, delay in enumerate(stack.delays or []):
        if delay > 0.0 and index not in initiated and index < stack.size:
            yield Fault(
                "stack.delays", f"found {delay:g} s for {names[index]}, which waits for the shock; allowed: 0 s for it"
            )


def row(count: int, pitch: float) -> Array:
    """Offsets (count, 3) in m of rounds side by side along x, from centre to centre `pitch` (m), evenly about x = 0."""
    return pallet((count, 1, 1), (pitch, 0.0, 0.0))


def triangle(base: int, pitch: float, axis: Sequence[float]) -> Array:
    """Offsets (base (base + 1) / 2, 3) in m of rounds in each other's grooves, in rows of base, base - 1, ..., 1.

    Rounds that stand form an equilateral triangle seen from above, the first row along x; rounds that lie a pyramidal
    pile, one row on the other. `pitch` is from centre to centre of rounds that touch (m).
    """
    if stands(axis):
        along, up = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
    else:
        along, up = across_horizontally(axis), np.array([0.0, 0.0, 1.0])
    # The centroid of the places lies a third of the pile's height above its first row.
    lowest = -(base - 1) / 3.0 if stands(axis) else 0.0
    places = [
        ((column - 0.5 * (base - level - 1)) * along + np.sqrt(0.75) * (lowest + level) * up) * pitch
        for level in range(base)
        for column in range(base - level)
    ]
    return np.array(places)


def pallet(counts: Sequence[int], pitches: Sequence[float]) -> Array:
    """Offsets (n, 3) in m of columns, rows and layers: x fastest, then y, then z, evenly about x = 0 and y = 0.

    `counts` are those along x, along y and of layers, `pitches` from centre to centre (m); of no concern where there is
    one only.
    """
    steps = np.stack(np.meshgrid(*(np.arange(count) for count in reversed(counts)), indexing="ij"), axis=-1)
    steps = steps.reshape(-1, 3)[:, ::-1] - 0.5 * (np.array(counts) - 1) * [1, 1, 0]
    return np.asarray(steps * np.where(np.array(counts) > 1, pitches, 0.0))


def stands(axis: Sequence[float]) -> bool:
    """Whether a round with this axis stands upright, on its base or its nose."""
    return float(np.hypot(axis[0], axis[1])) <= _UPRIGHT * float(np.linalg.norm(axis))


def lies(axis: Sequence[float]) -> bool:
    """Whether a round with this axis lies level."""
    return abs(float(axis[2])) <= _UPRIGHT * float(np.linalg.norm(axis))


def across_horizontally(axis: Sequence[float]) -> Array:
    """The level unit vector across a level axis, x for a round along y, on the side of +x, else of +y."""
    across = np.array([axis[1], -axis[0], 0.0]) / float(np.hypot(axis[0], axis[1]))
    if across[0] < -_UPRIGHT or (abs(across[0]) <= _UPRIGHT and across[1] < 0.0):
        across = -across
    return across + 0.0  # no negative zero
