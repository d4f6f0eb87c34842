"""Every constant that tunes a statistical decision of a diagnosis.

Each constant says what it decides and what it was chosen by:

- *theory*: it follows from the statistics that its text names.
- *blind*: set with cases of ``studies/blind`` in view, synthetic campaigns whose generator shares
  no code with the package. The rates of its cases are in ``docs/diagnosis_rates.md``.
- *blind buildings*: the same with ``studies/blind_buildings``, 116 building records.
- *loops*: set with the loops of Li & Li 2013 and of Yu et al. in view (study
  ``published_isolator``).
- *effort*: it limits the computation; more would cost time and should change little.

No record was kept of single trials of these values; the studies above repeat their outcome.
"""

# How many causes

MOST_EFFECTS = 4
"""Effects that a search adds to a law on device tests. Blind: no campaign hides more than three."""
MOST_LOOP_EFFECTS = 3
"""The same on a loop table, which holds two numbers a row. Loops."""
MOST_BUILDING_CAUSES = 4
"""Causes that a search adds to a building. Blind buildings: no record hides more than two."""

# Device tests: is one more effect real?

SIGNIFICANT = 28.0
"""Decrease of the cost over that by noise from which an effect counts as found: the square of a
5.3 sigma deviation, so that a hundred forms together rarely reach it by chance. Theory."""
LEAST_PART = 3e-3
"""Share of the cost. A smaller decrease is within the errors of smoothing and integration.
Blind."""
LEAST_SHARE = 0.03
"""Share of the law's misfit. A smaller decrease usually corrects the shape of an effect that is
already in the model. Blind."""
CLEARLY_BETTER = 0.5
"""A generic term is taken if it leaves less than this share of the misfit that the best effect of
the catalogue leaves; the catalogue's forms are only nearly right. Blind (cases ``outside``)."""
NEW_SPECIMENS = 1.1
"""Factor on the misfit beyond noise that a cause which begins anew by itself may leave more than a
damage that each run begins without, which asks for a new specimen in each run. Convention, seen on
a fifteenth generator, where heat and amplitudes left 1.003 and 1.01 times as much."""
WELL_EXPLAINED = 0.15
"""Share of the law's misfit. If the best effect beside others leaves less, no generic term is
tried; one is not fitted either where a linear answer leaves so much more. Of a building: if its
causes leave less, no unknown force is looked for. Blind."""

# Device tests: does what was found stand on data that were not fitted?

TO_BLAME = 0.35
"""Share of the misfit on held-out data that causes must remove together to be named; of device
tests and of buildings. Blind (cases ``clean`` and ``outside``) and blind buildings."""
TO_BLAME_FITTED = 0.4
"""The same on the fitted runs of device tests: a law that diverges on held-out runs makes any
effect look helpful there. Blind (cases ``outside``)."""
REMAINS = 0.03
"""Error that the causes leave, over the force and beyond noise, above which all laws are compared,
during the search and after it: the law may be of the wrong family. Convention."""
NEARLY_ALL = 0.1
"""Share of the misfit on the data that judge that may remain beyond noise where the verdict is
"explained" because no model attains less; on the searched data, below which the search goes on
where another law alone is far better. Convention, seen on tests of unknown devices."""
FITTED_ALONE = 4.0
"""Squared error on the data held out over that of noise above which a law that is adequate on the
fitted data is not said to be so in general. Clean campaigns reach 3. Convention."""
MOSTLY_NOISE = 0.5
"""Noise over the signal from which the verdict "adequate" says how much it is. Convention."""
PROPOSED = 14.0
"""As ``SIGNIFICANT``, of a cause that held-out runs have yet to confirm: the law alone follows the
fitted runs and misses those. A 3.7 sigma deviation. Theory."""
WITH_A_CAUSE_LESS = 1.01
"""Factor on the error that causes leave up to which another law with a cause less, and no more
numbers, is diagnosed in place of the one chosen among all. Convention."""
MANY_EFFECTS = 3
"""Effects from which laws are compared, since another may need none. Effort."""
FAR_BETTER = 3.0
"""Factor on the error of another law alone above which the search for more causes ends. Blind
(``wrong_law``)."""
ADEQUATE = 1.25
"""Cost over that of noise below which a law is adequate, and with effects "explained". Blind
(``clean``)."""
ADEQUATE_FORM = 1.08
"""The same in the fitted runs, up to which a further cause of device tests would mend the form of
those found. Convention, seen on three generators: superfluous ones removed 3 to 4.4 % of the
noise's cost, and right ones 12 and 13 %."""
CHANCE_OF_FEW = 2.0
"""Standard deviations by which the squared residual of a few samples may exceed that of their
noise, both estimated from as many samples. It counts below 256 samples. Theory."""
SIGNIFICANCE = 0.002
"""Share of the force, RMS, below which an effect or a remainder is negligible in practice; a user
may set another. Convention."""
MINOR = 0.05
"""Share of what all causes explain below which one of them only mends the form of another.
Convention, seen on a third family of effects."""
MOST_MINOR = 0.02
"""Share of the force from which a cause counts in any case, however large the misfit or the other
causes are. Convention, seen there too."""
COMPLETES = 0.4
"""Share of what the causes before leave, on fitted and on held-out data, from which a cause counts
however small a share of the whole misfit that is; of device tests and of buildings. Convention,
seen on shaking-table cases of others."""
NEARLY_COMPLETES = 0.7
"""The same of a cause before those beside it are exchanged for others. Effort."""
MAY_BE_ZERO = 0.1
"""Share of the misfit below which one of several causes counts only if the interval of its size
excludes zero, and below which what only acts like a cause leaves little unexplained. Convention,
seen on blind pairs and on an eighth generator: of causes whose size may be zero, wrong ones removed
up to 0.055, and right ones 0.27 and more."""
VANISHES = 0.5
"""Share of an effect's force that may be left where its size is zero: beyond it other numbers keep
the effect up. Convention, seen on a lag in two stages."""
BESIDE_REMAINDER = 0.7
"""Share of the squared misfit that remains which one of several causes must correct: less only
mends the form of another. Convention, seen on results of five generators: eight of eight causes
below it were wrong; right ones correct 0.9 and more."""
FORM_LEAVES = 0.04
"""Share of the misfit that causes of the right form leave on fitted or on held-out runs. Where more
than noise and than this remains on both, another effect may act alike. Convention, seen on a
twenty-first and a twenty-second generator: right causes left 0.03 and less, and what only looked
like one of the catalogue 0.044 and more."""
LOST = 0.1
"""Squared error that worse held-out runs add, over that which other ones lose, above which causes
do not hold: their forms are never exact. Convention, seen on a third family of effects."""
WORSE = 1.1
"""Factor on the error of a held-out run above which the extended law counts as worse there. Blind
and the MR damper."""
CONFUSABLE_GAIN = 0.1
"""Share of a cause's gain by which a rival may fall short and still be confusable. Blind."""
FAR_OFF = 5.0
"""Factor on the least error of a law above which no equation is looked for beside a law of the
wrong family: it would stand in for the other law. Convention."""
NUMBERS_WRONG = 0.02
"""Least share of the misfit that refitting must remove to blame given parameter values. Blind."""

# Device tests: noise and interference

NOISE_EXAMPLES = 6
"""Simulated residuals of noise alone. Effort."""
UNDETERMINED = 0.1
"""Share of a value in directions that the data do not determine, above which its interval is
unbounded. Convention."""
OFF_BOUND = 0.3
"""Share of its range, or of its value if that range is wide, by which a value is moved away from a
bound. Convention."""
BOUND_NEEDED = 0.02
"""Share of a cause's gain that may be lost there. Then the data only do not determine the value,
and the cause does not merely act like one. Convention, seen on a third family of effects."""
RUNAWAY_SHIFT = 0.3
"""Share of a run's force. Displacement noise that moves a law further meets a law that diverges;
the run then has force noise only. Blind."""
INTERFERENCE_LOWEST = 0.5
"""Hz. A slower periodic change counts as drift. Blind (cases ``outside``)."""
INTERFERENCE_SHARE = 0.03
"""Share of the squared residual. A smaller disturbance is not removed. Blind (``outside``)."""
INTERFERENCE_LINE = 8.0
"""Power of a line over its neighbourhood; white noise exceeds it once in 3000. Theory and blind."""
INTERFERENCE_SIDEBANDS = 2.0
"""Power of a line over that one and two cycles of the motion beside it. Interference that modulates
a sinusoidal force has a quarter of its power there, and friction, whose multiples of the motion's
frequency fall slowest, more than half of it. Theory."""
INTERFERENCE_RUNS = 0.25
"""Share of the runs in which the line may be missing. Blind (cases ``outside``)."""
INTERFERENCE_HARMONICS = 16
"""Multiples of a run's own frequency that are left out of its periodogram. Blind."""

# Device tests: how many fits

TRIED = 14
"""Forms that are fitted after all have been screened. Effort."""
TERMS_TRIED = 3
"""Generic terms that are fitted beside them. Effort."""
RATE_SAMPLES = 2.0
"""Samples over which a term takes the rate of the current. Convention."""
RIVALS_TRIED = 4
"""Forms, of device tests, and causes, of buildings, that are fitted in the place of one found
before. Effort."""
RUNS_AWAY, FARTHEST = 0.5, 10.0
"""Share of a fitted model's cost that its values promise to remove to first order, from which one
of them runs away, and the step over its value by which that one is known. Convention, seen on a
standard solid that had become rigid: no effect was found beside it."""
SCREEN_STARTS = 12
"""Shapes of an effect that are screened before one is fitted. Effort."""
REFINE_STEPS = 6
"""Steps that fit an effect's shape alone. Effort."""
REFITTED = 3
"""Best candidates that are refitted from the law's first values. Effort."""
WORTH_REFITTING = 0.5
"""Share of the best candidate's gain from which another candidate is refitted, and from which it is
tried again in the place of the one taken; of buildings, from which a late cause is fitted with all
numbers. Effort."""
WORTH_FITTING, MUCH_EXPLAINED = 0.4, 0.3
"""Where an effect explains the second share of the cost: share of its gain that another one must be
expected to bring to be fitted. Effort: of 383 fits for pairs of the blind studies, none of those
left out gained more than 0.6 of the best."""
SEARCH_STEPS = 12
"""Steps of a candidate's fit during the search. Effort."""
MANY_STEPS = 4
"""Integration steps a sample, on average, from which the search looks for fewer. Effort."""
FEWER_STEPS = 2
"""Factor by which integration steps must differ to be changed during the search. Effort."""
RESOLVED_MISFIT = 0.005
"""Error of integration during the search, over the misfit of the law alone. Effort; the last fits
have the usual error."""
COARSEST_STEPS = 2e-3
"""Error of integration during the search, over the force, at most. Effort."""

# Loop tables

LOOP_ACCURACY = 0.05
"""Relative error of stiffness and damping below which a table counts as reproduced. A table does
not tell its noise; published tests of one device agree to about so much. Loops."""
LOOP_GAIN = 0.8
"""An effect must lower the error on rows left out to less than this share. Loops."""
LOOP_RIVAL = 0.1
"""Relative excess of the error on rows left out below which a rival is confusable. Loops."""
LOOP_ROWS = 20
"""Rows on which causes are searched, of a table with more than ``LOOP_WHOLE``. Effort."""
LOOP_WHOLE = 30
"""Rows up to which causes are searched on the whole table. Effort."""
LOOP_CYCLES = 4
"""Cycles of each test in a search on some rows; the outcome is fitted with all. Effort."""
LOOP_FOLDS, LARGE_LOOP_FOLDS = 16, 6
"""Groups of rows that are left out in turn; in a short table every row is one. The second number
is for a table that is searched on some rows. Effort."""
LOOP_LAWS, LARGE_LOOP_LAWS = 6, 3
"""Sets of law parameters, nearly as good as the best, from which an effect is fitted. The second
number is for a table that is searched on some rows. Effort."""
LOOP_FITTED = 16
"""Forms that are fitted to the end, of all that were begun. Effort."""
LOOP_COMPARED = 6
"""Forms that are evaluated on rows left out. Effort."""
LOOP_CORRELATION = 0.25
"""Squared rank correlation from which the errors depend on a condition of the tests. Convention."""

# Building records

FALSE_ALARM = 0.003
"""Level of the tests for one more cause, all candidates together. Blind buildings (``clean``)."""
LEAST_BUILDING_SHARE = 0.02
"""Least share of the whole misfit that a cause must remove. Blind buildings."""
MOST_BESIDE_FORCE = 2
"""Most causes of the structure and of sensors that show beside any force of the isolators and are
begun with, and of the isolators beside these: more of them imitate something else. Convention; seen
on blind buildings.
"""
MINOR_IN_BUILDING = 0.01
"""Share of the signal. A cause beside others that corrects less, and less than
``LEAST_BUILDING_SHARE`` of what all correct, only mends their form. Convention; seen on
blind pairs.
"""
NEARLY_RIGHT = 0.1
"""Share of the error that even the right cause leaves, since its form is not exact. Unknown forces
whose squared errors differ by less than the square of it are not told apart. Blind buildings."""
INSTEAD = 0.5
"""Error that another search must leave, over that of the first one, for its causes to be named
instead; and causes that are tried last, over the best of the others. A fit in the place of a cause
that begins far from it is not brought to its end. Convention.
"""
NOT_WORSE = 1.02
"""Largest factor by which a cause may raise the mean square in a half of the held-out time. Blind
buildings."""
STRONG_EVIDENCE = 6.0
"""Difference of Schwarz's criterion below which rivals are confusable; evidence is strong beyond it
(Kass and Raftery 1995). Theory."""
QUIET = 0.1
"""Chance of the residuals under noise alone above which no cause is searched. Blind buildings."""
MISFIT_LEVEL = 0.005
"""Level of the test for adequacy. Theory: rate of false alarms."""
BUILDING_EXPLAINED = 0.95
"""Removed share of the misfit above which the verdict is "explained". Blind buildings."""
SEVERAL_TIMES = 3.0
"""Error that causes leave beyond the noise, over the noise, above which they do not explain a
record, however little of the signal it is: right ones of an inexact form left 2.8 and less, and a
limit of the supply in place of a saturation 5. Convention, seen on records of two authors."""
UNRESOLVED = 0.5
"""Part of a sample. A cause beside others that changes the current less than a delay by so much
does not differ from how the current goes between the samples: held and linear are so far apart.
Theory.
"""
TURNED = 0.1
"""Distance of a sensor's gain from -1 at which its sign counts as turned: beside an error of its
calibration. Convention."""
SWITCHING = 2.0
"""Standard deviations of the errors by changes of the current at unknown moments within a sample,
up to which what the model misses may be nothing else. Theory: 95 % of normal errors."""
FITTED_ENERGY = 0.6
"""Share of a lone record's energy that is fitted; later samples are held out. Convention."""
QUIET_ENERGY = 0.005
"""Share of a lone record's energy before and after which it is quiet, whatever the noise of its
sensors up to 5 %. Convention.
"""
MOST_NOISE = 0.5
"""Share of noise in a channel's RMS from which the mean error of the channels leaves it out.
Convention."""
LEAST_SENSOR_NOISE = 1e-3
"""Smallest sensor noise, as a share of a channel's RMS. Instruments' data sheets."""
MOST_CURRENT_NOISE = 3e-3
"""Largest noise of a recorded current, as a share of its range: what is more is its fast changes.
Instruments' data sheets."""
MOST_COLOUR = 4.0
"""Largest noise of a sensor in the building's band over that above it, at equal widths of
frequency. That of noise whose power falls with the frequency over four octaves; slower and stronger
noise is no longer that of instruments. Noise that falls above the band may be more by as much.
Convention."""
LEAST_SENSOR_ERROR = 3e-3
"""Smallest calibration error, as a share of a channel's reading. Instruments' data sheets."""
MANY_NUMBERS = 3
"""Numbers of a cause from which simpler ones are tried in its place at the end: at the ends of
their ranges many imitate a single one. Effort; seen on records of others.
"""
STARTS_FITTED = 2
"""Starts of each cause that are fitted: those with the least misfit. Effort."""
MOST_REFINED = 8
"""Causes that are fitted further after one step from the best start of each. Effort."""
SIMULATED, LATE_SIMULATED = 16, 4
"""Causes, of those that need a simulation, that are fitted: those that follow the residual best to
first order; of those that are only tried late, fewer. Effort."""
ALONG_MOTION, PROPOSALS = 24, 3
"""Forms of effects that are fitted along the isolators' motion, of those that follow their force
best to first order, and causes of these that are then tried in the building. Effort."""
ABRUPT = 1e-3
"""Range over which friction of the isolators develops, over the largest deformation or velocity,
below which it is not looked for. A deformation crosses it within a sample, and simulations of less
take up to 1000 times as long. Effort."""
PROPOSED_GAIN = 0.1
"""Share of the layer's misfit above noise that a form must remove to be tried: else what is wrong
is elsewhere, or in the numbers of the effects that are already there. Effort."""
FOLLOWS, BEGUN_WELL = 0.1, 0.4
"""Shares of the best cause's gain: that which one must promise to first order to be fitted, and
that which it must bring in one step to be fitted further. Effort: of ten records, the cause that
was best at the end of a round promised 0.5 or more and brought 0.8 or more."""
FORMS_TRIED = 6
"""Forms of one cause among those that are fitted. Effort."""
SCREENING_STEPS, REFINED = 4, 4
"""Steps of a first fit of each cause, and causes that are then fitted with all numbers. Effort."""

# What a residual depends on

RESIDUAL_BLOCK = 0.5
"""s. Alternating blocks of device tests are fitted and evaluated in turn. Convention."""
LEAST_DEPENDENCE = 0.05
"""Share of the misfit below which a dependence is not named. Blind (cases ``outside``)."""
NEARLY_AS_MUCH = 0.8
"""Share of the best prediction with which a smaller set of variables is preferred. Blind
(``outside``)."""
DEPENDENCE_LEVEL = 1e-3
"""Level of the test for a dependence of a building's residual. Theory: rate of false alarms."""

# Gain

RESAMPLES = 2000
"""Resamples behind the interval of a gain. Effort."""

# Stability

REDRAWN = 200
"""Resamplings of the runs behind a cause's stability. Effort."""
NEEDED = 0.5
"""Share of the fits from other runs in which a cause must be more than noise to be named.
Convention."""
RIVAL_WINS = 0.1
"""Share of the refits in which a rival is named instead, above which it is confusable.
Convention."""

# Equation and learned term

TIER_SAMPLES = 6000
"""Samples, about, on which terms are selected. Effort."""
EQUATION_TERMS = 6
"""Terms of an equation, at most. Convention: more cannot be read."""
EQUATION_GAIN = 0.03
"""Share of the squared error on conditions left out that a term must remove. Blind (``outside``)
and MR damper."""
IMITATION = 0.25
"""Share of the squared misfit left by causes below which an equation in their place, or an unknown
force on a building, says that they only imitated it. Convention; seen on blind cases
(``outside:centred_bump``)."""
MUCH_LEFT = 0.2
"""Share of the squared misfit that causes must leave for a condition on which they lose to speak
against their names, and to doubt those that correct less than what only acts like a cause.
Convention, seen on three laboratories: right causes left 0.03, 0.04 and 0.16 there, and wrong ones
0.25 and 0.43."""
EQUATION_STANDS_OUT = 0.2
"""Share of the squared residual that the strongest term must remove to be fitted through the
simulation although the linear regression predicts no gain on conditions left out. Convention; seen
on one blind case (``outside:current_rate``)."""
EQUATION_SIGNIFICANT = 18.0
"""Decrease of the cost over that by noise, as correlated as the residual, from which a term is no
chance: of a hundred terms with two numbers one in a hundred times one reaches it. Theory."""
EQUATION_STABLE = 0.6
"""Share of the conditions without which a term must be chosen as well. Convention (Meinshausen and
Buehlmann 2010)."""
NEARLY_CHOSEN = 0.7
"""Share of the largest gain from which a term counts as chosen: neighbours on the grid of numbers
are alike. Convention, tried on the MR damper."""
SIMPLER = 0.95
"""Share of the best term's gain from which a term with fewer numbers is preferred. Convention."""
LEARNED_UNITS = 60
"""Units of the learned term. Effort."""
LEARNED_PENALTIES = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0, 10.0)
"""Penalties of the ridge regression that are tried. Effort."""
DISSIPATIVE_GAIN = 0.9
"""Share of a free network's gain on conditions left out from which one that dissipates by
construction is preferred. Convention."""
BEYOND_TESTS = 1.5
"""Factor on the tests' motion up to which an extended law must dissipate and stay finite.
Convention."""
NEGLIGIBLE_LOSS = 0.03
"""Share of the law's error on all conditions left out by which a tier may lose on one of them.
Convention; as ``EQUATION_GAIN``."""
EQUATION_PREFERRED = 1.05
"""Factor on the learned term's left-out error up to which the equation is offered. Convention."""

# The next tests

BEYOND_TESTED = 1.5
"""Factor on the largest tested velocity, acceleration and force up to which a test that tells two
causes apart is proposed. Convention."""
RIG_MARGIN = 1.02
"""Factor on the largest tested velocity and acceleration up to which a missing condition is
proposed. Convention."""
SINUSOIDAL = 0.03
"""Share of a motion's variance beside its sinusoid up to which a run is a sinusoid, in the middle
half: it may begin and end softly. Convention."""
STEADY_CURRENT = 0.02
"""Range of a current over the largest one up to which it is steady. Convention."""
GRID_CELLS = 4
"""Conditions of a grid per tested one, up to which the tests are taken for a grid. Convention."""
