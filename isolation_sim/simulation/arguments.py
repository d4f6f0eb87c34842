"""Arguments of the compiled kernel, in groups; the arrays' last axis is the lane."""

from __future__ import annotations

from typing import NamedTuple

from numpy.typing import NDArray


class Sizes(NamedTuple):
    """Numbers that stay the same during a run."""

    # ``controller`` is the address of a compiled controller, or 0; ``record_steps`` says whether
    # every step is recorded, ``clamp`` whether commands outside the driver's limits are clamped.

    n_modes: int
    n_pad: int
    n_elements: int
    n_ground: int
    n_channels: int
    n_windows: int
    n_levels: int
    n_outputs: int
    controller: int
    record_steps: bool
    clamp: bool


class Limits(NamedTuple):
    """Tolerance of the iteration, and the largest error of a step and of samples inside it."""

    iteration: float
    error: float
    defect: float
    deformation: NDArray


class Course(NamedTuple):
    """Windows of the grid, their lengths by class, events, and the ground acceleration."""

    windows: NDArray
    spans: NDArray
    events: NDArray
    ground: NDArray


class Propagation(NamedTuple):
    """Coefficients of the linear structure by class of windows and level; see ``Tables``."""

    offsets: NDArray
    modes: NDArray
    table: NDArray
    built: NDArray
    phi: NDArray
    integral: NDArray


class Measurements(NamedTuple):
    """Rows and noise of the measurements, when they are decided on, and the decisions."""

    rows: NDArray
    noise: NDArray
    measured: NDArray
    chosen: NDArray
    decided: NDArray
    measured_for: NDArray
    addresses: tuple[int, ...]


class Coils(NamedTuple):
    """Commands, drivers and currents of the coils, and the current that each element has."""

    command: NDArray
    driver: NDArray
    current: NDArray
    applied: NDArray
    moving: NDArray
    history: NDArray


class LawNumbers(NamedTuple):
    """Parameters of the elements' laws as polynomials in the current, and their coil channels."""

    table: NDArray
    breaks: NDArray
    shape: NDArray
    channel: NDArray


class Lanes(NamedTuple):
    """Where each lane is, and how its steps go."""

    # ``level``: of its steps, ``base`` at the window's start; ``place``: in the window; ``tried``:
    # steps in the window; ``hold``: windows until coarser steps are tried; ``active``, ``going``,
    # ``todo``: takes part in the step, in the iteration, in the window; ``last``: length of the
    # last step; ``previous``, ``contraction``: of the iteration; ``defects``: how far the force
    # polynomial misses the force at the step's ends, relative to the peak force, infinite where the
    # iteration did not contract; ``errors``: estimated effect of that on the response; ``kinks``:
    # whether an element has a kink within the step; ``worst``: error in the window.

    level: NDArray
    base: NDArray
    place: NDArray
    tried: NDArray
    hold: NDArray
    alive: NDArray
    active: NDArray
    going: NDArray
    todo: NDArray
    last: NDArray
    previous: NDArray
    contraction: NDArray
    defects: NDArray
    errors: NDArray
    kinks: NDArray
    worst: NDArray
    missed: NDArray
    counts: NDArray


class History(NamedTuple):
    """Modes, states and forces at the grid points, and the steps that are recorded."""

    z: NDArray
    states: NDArray
    forces: NDArray
    steps: NDArray
    step_count: NDArray
    cuts: NDArray
    first_step: NDArray
    last_step: NDArray


class Scratch(NamedTuple):
    """Numbers of the elements (``element_code.py``) and the ground acceleration in a step."""

    w: NDArray
    u: NDArray


class Step(NamedTuple):
    """A step of the integration: the part ``number`` of ``n_steps`` equal ones of a window."""

    # ``at``: where it begins, in shortest steps, of which a window has ``whole``; ``depth``: its
    # level; ``n_intervals``: grid intervals of the window, ``n_sub`` of the step; ``per_interval``:
    # steps of a grid interval; ``point``: the grid point at or before its start; ``start``,
    # ``end``: rows of the modes; ``fresh``: lanes that begin with this length; ``offset``: of its
    # coefficients; ``length``: s; ``share``: by how much its error counts; ``left``: what the
    # iteration may leave.

    at: int
    depth: int
    number: int
    n_steps: int
    n_intervals: int
    n_sub: int
    per_interval: int
    point: int
    start: int
    end: int
    fresh: int
    offset: int
    whole: int
    length: float
    share: float
    left: float


class Intervals(NamedTuple):
    """Windows of the grid, each grid interval's window and length, and the ground acceleration."""

    windows: NDArray
    window_of: NDArray
    lengths: NDArray
    ground: NDArray


class Quantities(NamedTuple):
    """Quantities whose peaks and mean squares are wanted."""

    # ``rows``: blocks of eight rows over the modes' real and imaginary parts, the elements' forces
    # beyond their references and the ground accelerations; a quantity is the norm of
    # ``n_directions`` consecutive rows. ``fast``: modes too fast for the grid; ``fast_moduli``: of
    # the rows for them; ``fast_forced``: most that a bend of an element's force moves through them;
    # ``follows``: what they follow, its sign turned, per ground acceleration and force, and per
    # rate of these.

    rows: NDArray
    n_quantities: int
    n_directions: int
    fast: NDArray
    fast_moduli: NDArray
    fast_forced: NDArray
    follows: NDArray


class Candidates(NamedTuple):
    """Grid intervals in which a quantity may exceed its peak, lane by lane."""

    # ``place``: interval and number of the quantity; ``bound``: of the quantity in it; ``number``:
    # of candidates; ``chosen``: quantities that are evaluated at once.

    place: NDArray
    bound: NDArray
    number: NDArray
    chosen: NDArray


class SummaryScratch(NamedTuple):
    """Quantities at some grid points, and their bounds in between."""

    # ``points``, ``present``: grid points evaluated at once and the elements' forces there;
    # ``values``: of each block of quantities, just after a change of current at some points, then
    # just before it where it is ``changed``; ``near``: how many are near their peaks; ``bulges``,
    # ``margins``, ``bounds``: of forces and quantities inside an interval; ``swings``: of fast
    # modes, ``loudness``: of the quantities by them, ``unrest``: by all of them at some points.

    points: NDArray
    present: NDArray
    values: NDArray
    changed: NDArray
    near: NDArray
    bulges: NDArray
    margins: NDArray
    bounds: NDArray
    swings: NDArray
    loudness: NDArray
    unrest: NDArray


class DenseScratch(NamedTuple):
    """One lane's response at some instants inside a grid interval."""

    # ``weights``: decay of the modes between two instants and the effect of inputs, ``weights_for``
    # a time and the lane of a table; ``polynomials``: forces through the nodes, and through the
    # ends too; ``z``, ``forces``, ``ground``, ``values``: at the instants numbered ``points``;
    # ``rows``: a block's; ``last``: each quantity's last two values.

    state: NDArray
    weights: NDArray
    weights_for: NDArray
    polynomials: NDArray
    z: NDArray
    forces: NDArray
    ground: NDArray
    rows: NDArray
    values: NDArray
    points: NDArray
    last: NDArray
    integral: NDArray
    phi: NDArray
