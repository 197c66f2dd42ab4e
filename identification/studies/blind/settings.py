"""Settings of the blind check."""

from dataclasses import dataclass, replace

from identification.studies.blind.kinds import EXCLUDED_EFFECT, NOMINAL, ONE_CAUSE, TWO_EFFECTS


@dataclass(frozen=True, kw_only=True)
class BlindSettings:
    """Judgements of the blind check, by the stage that uses them."""

    forms: str = "usual"
    """Name of the study's forms in FORMS; a folder holds trials of one study only."""

    # Draw of the truths. How large a drawn effect is: effect_draws.py.
    kind_counts: tuple[tuple[str, int], ...] = (
        (NOMINAL, 10),
        (ONE_CAUSE, 25),
        (TWO_EFFECTS, 6),
        (EXCLUDED_EFFECT, 9),
    )
    """Trials of each kind among every fifty [-]."""
    effect_copies: int = 3
    """Draws of each effect for one draw of each parameter [-], among the trials with one cause."""
    calibrated_spread: float = 0.06
    """Half width of the four calibrated parameters about Table 12 [-], relative, uniform."""
    unit_scatter: float = 2e-3
    """Relative standard deviation of every other parameter from unit to unit [-]."""
    unit_scatter_limit: float = 2.0
    """Largest deviation of such a parameter [standard deviations]: units are inspected when built."""
    form_deviation: tuple[float, float] = (0.03, 0.15)
    """Least and largest deviation of an effect's form from the fitted form, relative to the effect [-]
    (deviating_forms.py)."""
    other_form_share: float = 0.5
    """Probability that an effect has its other form, where it has one (other_forms.py) [-]: as often as
    not, since nobody knows which curve a real valve follows."""
    top_effects: tuple[str, ...] = ("armature_bounce", "supply_restriction", "magnetic_saturation")
    """Effects that are also drawn at the top of their range. Log-uniform draws seldom come near it, and
    there these three were missed on campaigns of another simulator."""
    top_share: float = 0.3
    """Probability that such an effect is drawn at its top [-]: about two trials each of 300."""

    # The bench of the blind check.
    omitted_programmes: tuple[str, ...] = ("rest", "high_voltage")
    """Programmes of the diagnosis suite that are not run. A record at rest would remove a constant
    sensor bias, which is one of the effects."""
    supply_voltage: float = 24.0
    """Coil voltage in every recording [V]: the driver's drop can hide behind the resistance."""
    solvers: tuple[tuple[str, float], ...] = (
        ("LSODA", 1e-6),
        ("LSODA", 1e-8),
        ("Radau", 1e-6),
        ("Radau", 1e-8),
    )
    """SciPy's methods with relative tolerances [-], tried in turn: LSODA's interpolant may lose an
    event."""
    solver_evaluations: float = 3e5
    """Most evaluations of the right-hand side for one recording [-]: a mover that chatters between
    sticking and slipping would need infinitely many."""
    warm_up_recordings: float = 3.0
    """Recordings after which a winding is within 1/e of its highest temperature [-]."""
    warming_range: tuple[float, float] = (0.8, 1.2)
    """Range of the winding's temperature relative to an even warming [-]."""
    attempts: int = 5
    """Draws of a trial with the same causes before the check gives up [-]."""
    salt_bytes: int = 16
    """Length of the salt in a label [bytes]: its hash tells nothing of the content."""

    # The gap without noise.
    explainable_threshold: float = 1.02
    """Noise-free gap after recalibration below which nothing is left to explain [-]; `no_gap` is then
    the correct verdict."""
    difference_step: float = 1e-4
    """Relative change of a parameter for a finite difference [-]."""
    fit_tolerance: float = 1e-4
    """Relative change of the sum of squares, or of the parameters, at which a fit ends [-]."""
    fit_evaluations: int = 20
    """Most steps of a fit [-]."""
    largest_size_ratio: float = 3.0
    """Largest size relative to the size at which the search begins [-]."""
    lost_residual: float = 1e3
    """Residual of samples that a model does not reach [noise deviations]."""
    temperature_tolerance: float = 0.01
    """Tolerance of the fitted winding temperature [K]."""

    # Disturbances under which a study is diagnosed again.
    ripple_channels: tuple[str, ...] = ("p2", "p3")
    """Channels with a slow ripple: the pressures that a supply's pulsation reaches."""
    ripple_size: float = 2.0
    """Standard deviation of the ripple [sensor noises]: large enough to be seen in a recording."""
    ripple_time: float = 0.02
    """Correlation time of the ripple [s]: as long as the valve's transients, which it imitates."""
    pressure_step: float = 0.05
    """Step of coarse pressures [bar]: the resolution of a vehicle's bus."""

    # Scores.
    held_probability: float = 0.9
    """Probability of being part of the truth from which an effect counts as held, and is named by the
    verdict `partial` [-]: the contract's."""
    tie_margin: float = 1e-3
    """Difference of probability up to which two causes are tied [-]: no one acts on less."""
    smallest_gap: float = 0.02
    """Gap above the floor of 1 below which its reduction is not scored [-]."""
    distinguishable_distance: float = 1.0
    """Distance of a rival below which no test separates it from the truth in more than 69 % of the cases
    [noise deviations]."""
    gap_bins: tuple[float, ...] = (1e-3, 3e-3, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 1e3)
    """Edges of the bins of the explainable gap above the floor of 1 [-]."""

    # Calibration of the probabilities.
    calibration_bins: int = 10
    """Bins of a reliability diagram [-]: with 300 answers the fullest ones still have narrow
    intervals."""
    least_inclusion: float = 0.01
    """Least probability of an effect that counts as a statement about it [-]: below lie thousands of
    effects that nobody would look at, whose truth would drown the rest."""
    bootstrap_draws: int = 2000
    """Draws of trials for the interval of a calibration error [-]: its ends are then stable to some
    percent of its width."""
    bootstrap_seed: int = 0
    """Seed of these draws: the same trials give the same interval."""

    @property
    def scatter_reach(self) -> float:
        """Largest relative deviation of a parameter from unit to unit [-]."""
        return self.unit_scatter_limit * self.unit_scatter


DEFAULTS = BlindSettings()
"""The settings of docs/results/blind-diagnosis.md."""

STRONG = replace(DEFAULTS, forms="strong", form_deviation=(0.20, 0.50))
"""The second study: forms so far from the fitted ones that probabilities must say so."""

FORMS = {settings.forms: settings for settings in (DEFAULTS, STRONG)}
"""The settings of each study by the name of its forms."""
