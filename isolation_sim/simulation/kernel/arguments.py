"""Arguments of the compiled kernel in groups; the last axis of the arrays is the lane."""

from __future__ import annotations

from typing import NamedTuple

from numpy.typing import NDArray


class Sizes(NamedTuple):
    """Constants of a run."""

    # ``n_states``: largest number of an element; ``controller``: address of a compiled controller,
    # or 0; ``record_steps``: whether every step is recorded; ``clamp``: whether commands outside
    # the driver's limits are clamped.

    n_modes: int
    n_pad: int
    n_elements: int
    n_ground: int
    n_channels: int
    n_segments: int
    n_levels: int
    n_outputs: int
    n_states: int
    controller: int
    record_steps: bool
    clamp: bool


class Limits(NamedTuple):
    """Tolerance of the iteration, and largest errors of a step and of the samples inside it."""

    iteration: float
    error: float
    defect: float
    deformation: NDArray


class TimeGrid(NamedTuple):
    """Segments of the grid, their lengths by class, events, and the ground acceleration."""

    segments: NDArray
    spans: NDArray
    events: NDArray
    ground: NDArray


class Propagation(NamedTuple):
    """Coefficients of the linear structure by class of segments and level; see ``Tables``."""

    offsets: NDArray
    modes: NDArray
    table: NDArray
    built: NDArray
    phi: NDArray
    integral: NDArray


class Measurements(NamedTuple):
    """Rows and noise of the measurements, instants of the decisions, and decisions."""

    rows: NDArray
    noise: NDArray
    measured: NDArray
    chosen: NDArray
    decision_times: NDArray
    measured_for: NDArray
    addresses: tuple[int, ...]


class Coils(NamedTuple):
    """Commands, drivers and currents of the coils, and the present current of each element."""

    command: NDArray
    driver: NDArray
    current: NDArray
    applied: NDArray
    moving: NDArray
    history: NDArray


class LawNumbers(NamedTuple):
    """Parameters of the elements' laws as polynomials in the current, and their coil channels."""

    # ``functions``: address of each element's compiled law, 0 of a further direction of the element
    # before; ``numbers``: its parameters, their first slot and its directions, (n_elements, 3).

    table: NDArray
    breaks: NDArray
    shape: NDArray
    channel: NDArray
    functions: NDArray
    numbers: NDArray


class Lanes(NamedTuple):
    """Progress and step control of each lane."""

    # ``level``: level of the steps, and ``base`` at the segment's start; ``place``: place in the
    # segment; ``tried``: number of steps in the segment; ``hold``: number of segments before
    # coarser steps are tried; ``active``, ``going``, ``todo``: whether the lane takes part in the
    # step, in the iteration, in the segment; ``last``: length of the last step; ``previous``,
    # ``contraction``: last change and convergence factor of the iteration; ``defects``: difference
    # of force polynomial and force at the step's ends over the peak force, infinite if the
    # iteration did not converge; ``errors``: its estimated effect on the response; ``kinks``:
    # whether an element has a kink within the step; ``worst``: largest error in the segment;
    # ``alive``, ``counts``: see ``slots.py``; ``missed``: largest error of a step that missed the
    # tolerance.

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
    """Modes, states and forces at the grid points, and the recorded steps."""

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
    """A step of the integration: the part ``number`` of ``n_steps`` equal ones of a segment."""

    # ``at``: start in units of the shortest step, of which a segment has ``whole``; ``depth``:
    # level of the step; ``n_intervals``, ``n_sub``: grid intervals of the segment and of the step;
    # ``per_interval``: steps per grid interval; ``point``: grid point at or before its start;
    # ``start``, ``end``: rows of the modes; ``fresh``: lanes with a new step length; ``offset``:
    # place of its coefficients; ``length``: s; ``share``: weight of its error; ``left``: tolerance
    # of the iteration.

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
    """Segments of the grid, segment and length of each interval, and the ground acceleration."""

    segments: NDArray
    segment_of: NDArray
    lengths: NDArray
    ground: NDArray


class Quantities(NamedTuple):
    """Quantities for peaks and mean squares."""

    # ``rows``: blocks of eight rows over the modes' real and imaginary parts, the elements'
    # residual forces and the ground accelerations; a quantity is the norm of ``n_directions``
    # consecutive rows. ``fast``: modes too fast for the grid; ``fast_moduli``: moduli of their
    # rows; ``fast_forced``: largest response of a fast mode to a bend of an element's force;
    # ``follows``: quasi-static response of the fast modes with opposite sign, per ground
    # acceleration and force, and per rate of these.

    rows: NDArray
    n_quantities: int
    n_directions: int
    fast: NDArray
    fast_moduli: NDArray
    fast_forced: NDArray
    follows: NDArray


class Candidates(NamedTuple):
    """Grid intervals in which a quantity may exceed its peak, for each lane."""

    # ``place``: interval and number of the quantity; ``bound``: upper bound of the quantity in the
    # interval; ``number``: number of candidates; ``chosen``: quantities evaluated together.

    place: NDArray
    bound: NDArray
    number: NDArray
    chosen: NDArray


class PeakScratch(NamedTuple):
    """Quantities at some grid points, and their bounds between the points."""

    # ``points``, ``present``: grid points of an evaluation and the elements' forces there;
    # ``values``: values of each block of quantities just after a change of current, then those just
    # before it, if ``changed``; ``near``: number of quantities near their peaks; ``bulges``,
    # ``margins``, ``bounds``: bounds of forces and quantities inside an interval; ``swings``:
    # amplitudes of fast modes; ``loudness``: their effect on the quantities; ``unrest``: effect of
    # all fast modes at some points.

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

    # ``weights``: decay of the modes between two instants and effect of the inputs;
    # ``weights_for``: time and lane of these weights; ``polynomials``: force polynomials through
    # the nodes, and through nodes and ends; ``z``, ``forces``, ``ground``, ``values``: at the
    # instants ``points``; ``rows``: rows of a block; ``last``: last two values of each quantity.

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
