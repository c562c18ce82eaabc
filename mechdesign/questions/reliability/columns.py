"""Tables of reliability and their columns: names, meanings, units and formulas."""

from __future__ import annotations

from mechdesign.ground.columns import ColumnKind
from mechdesign.ground.results import KeyNumber, TableKind
from mechdesign.questions.columns import GIVEN, TIMED, VALID
from mechdesign.questions.reliability.schema.methods import METHODS


def _rare(name: str, meaning: str, formula: str = "") -> ColumnKind:
    """A column of the probability of what is rare."""
    return ColumnKind(name, meaning, "", formula, tail=True)


METHOD = ColumnKind("method", "how it was computed")
OUTPUT = ColumnKind("output", "coordinate, or column of dynamics")
ORDER = ColumnKind("order", "position, velocity or acceleration; of efforts and forces 'dynamics'")
MEAN = ColumnKind("mean", "mean over made mechanisms, in `unit`")
EVALUATIONS = ColumnKind("evaluations", "mechanisms that were solved for it")
MOMENTS = TableKind.of("moments", "mean and standard deviation of outputs per pose and method",
    TIMED, GIVEN, METHOD, OUTPUT, ORDER, ("nominal", "value of the nominal mechanism, in `unit`"), MEAN,
    ("sigma", "standard deviation of the error, in `unit`", "",
     "analytic: sqrt(s^T V s), s the sensitivities and V the covariance of the sources"),
    ("worst_case", "sum of |sensitivity| times the larger end of the tolerance, in `unit`"),
    ("worst_low", "lowest error that the tolerances allow, in `unit`"),
    ("worst_high", "highest error that the tolerances allow, in `unit`"), ("unit", "unit of the six columns before"),
    VALID)  # fmt: skip
RELIABILITY = TableKind.of("reliability", "probability that the errors keep their limits",
    ("scope", "a pose by itself, or one made mechanism at all poses, the steps between unseen"), TIMED, GIVEN, METHOD,
    ("reliability", "probability that every limit is kept"), ("low", "lower end of its interval, <kind of interval>"),
    ("high", "upper end of its interval, <kind of interval>"),
    _rare("failure",
          "1 - reliability, without loss of digits; 0 where no failure was seen, and failure_high bounds it"),
    _rare("failure_low", "lower end of its interval, <kind of interval>; of a cycle's bounds the worst pose's"),
    _rare("failure_high", "upper end of its interval, <kind of interval>; of a cycle's bounds the poses' sum"),
    _rare("error", "3 sqrt(p (1 - p)/N) of the simulation [S2, eq. 16]; else half the interval"),
    ("samples", "samples that the value is taken from; 0: none"),
    ("invalid", "samples that cannot be assembled; they are failures"), EVALUATIONS,
    ("used", "where the value comes from: of auto, the method it used"),
    ("sigma_level", "quantile of the standard normal law, without a shift of 1.5 sigma, of the reliability", "",
     "Phi^-1(reliability)"), _rare("ppm", "failures in a million", "1e6 failure"),
    ("rho", "correlation of the two outputs"),
    ("valid", "1 where the nominal pose (all, of a cycle) is valid"))  # fmt: skip
CAPABILITY = TableKind.of("capability", "process capability of each limited output",
    TIMED, GIVEN, METHOD, OUTPUT, ORDER, ("lsl", "lower specification limit of the value, in `unit`; nan: none"),
    ("usl", "upper specification limit of the value, of a point the radius of its error, in `unit`"),
    ("nominal", "value of the nominal mechanism, in `unit`; nan of a point"), MEAN,
    ("sigma", "standard deviation of the value, in `unit`"), ("cp", "(USL - LSL)/(6 sigma); nan of a single limit"),
    ("cpk", "distance of the mean from the nearer limit over 3 sigma", "", "min(USL - mean, mean - LSL)/(3 sigma)"),
    ("sigma_level",
     "quantile of the standard normal law, without a shift of 1.5 sigma, of the share within the limits"),
    _rare("ppm", "values in a million outside these limits"),
    _rare("ppm_low", "lower end of its interval, 99.7 %, where samples are counted"),
    _rare("ppm_high", "upper end of its interval, 99.7 %, where samples are counted"),
    ("unit", "unit of the five columns from lsl to sigma"), VALID)  # fmt: skip
_INTERVAL = {"": "", "_low": ", lower end of its interval, 99.7 %", "_high": ", upper end of its interval, 99.7 %"}
_SOBOL = (
    ("first", "share of the output's variance that the source causes by itself [Sobol, 1993]",
     "Var(E[output | source])/Var(output)"),
    ("total", "share that the source causes by itself and together with others",
     "E[Var(output | all others)]/Var(output)"),
)  # fmt: skip
CONTRIBUTIONS = TableKind.of("contributions", "what the errors come from",
    TIMED, GIVEN, ("source", "parameter, dimension, drive, or clearance of a joint or coupling"), OUTPUT, ORDER,
    ("on", "links whose point the output is, where its pin has a clearance or gives; of several, midway"),
    ("sensitivity", "derivative by the source, all angles in radians; a pin's is sqrt(s_x^2 + s_y^2)", "",
     "d output/d source"), ("derivative", "the same for one unit of the source as the study counts it, in `unit`"),
    ("unit", "unit of `derivative`: the output's over the source's"),
    ("share", "share of the output's variance, to the first order", "", "(s_i sigma_i)^2/sigma^2"),
    *((f"sobol_{kind}{end}", f"{meaning}{words}", "", "" if end else formula)
      for kind, meaning, formula in _SOBOL for end, words in _INTERVAL.items()))  # fmt: skip
DENSITY = TableKind.of("density", "density of two errors: bivariate normal and simulation [S2, Figs. 4, 5]",
    GIVEN, ("<output>_error", "centre of the cell", "as the output"),
    ("x, y", "error of <output> about its mean, in deviations of the first order"),
    ("normal", "bivariate normal density, standardised"),
    ("simulated", "density of the samples, standardised"))  # fmt: skip
HISTOGRAM = TableKind.of("histogram", "errors drawn at the pose that is shown, and their normal fit",
    TIMED, GIVEN, OUTPUT, ORDER,
    ("low", "begin of the bin of errors, in `unit`"), ("high", "end of the bin, in `unit`"),
    ("count", "samples in the bin, of <samples>"),
    ("density", "their density, in 1/`unit`", "", "count/(samples (high - low))"),
    ("normal", "density of the normal law of the samples' mean and deviation, in 1/`unit`"),
    ("unit", "unit of the error"))  # fmt: skip
CONVERGENCE = TableKind.of("convergence", "trend of the means with the number of samples [S3, Fig. 4]",
    TIMED, GIVEN, ("samples", "valid samples so far"), OUTPUT, ORDER, ("mean", "their mean, in `unit`"),
    ("unit", "unit of the mean"))  # fmt: skip
ESTIMATE = TableKind.of("estimate", "probability of failure with the number of samples",
    TIMED, GIVEN, ("samples", "samples so far"),
    _rare("failure", "share of them that broke a limit or cannot be assembled"),
    _rare("failure_low", "lower end of its interval, 99.7 %, Clopper-Pearson"),
    _rare("failure_high", "upper end of its interval, 99.7 %, Clopper-Pearson"))  # fmt: skip
ALLOCATION = TableKind.of("allocation", "the cheapest tolerances that reach what is asked",
    ("source", "what varies"),
    ("kind",
     "tolerance: half its width; sigma; measured: the values' sigma; clearance: its mean radial one, or the backlash"),
    ("given", "as the study gives it, in `unit`"), ("allocated", "the cheapest, in `unit`"),
    ("unit", "unit of the two columns before"),
    ("grade", "standard grade of ISO 286-1 that it is, half to either side; empty where it is held"),
    ("cost_given, cost_allocated", "a/T^exponent; nan where it is held"),
    ("share", "share of the limited errors' variance (over the square of each limit) with the allocated tolerances, "
     "at the pose that fails most often"))  # fmt: skip
CONFIRMATION = TableKind.of("confirmation", "reliability, or Cpk, of the allocated tolerances",
    TIMED, GIVEN,
    ("asked", "reliability, or Cpk, asked for"), ("target", "what the analytic model had to reach for it"),
    ("analytic", "reliability, or least Cpk of any limit, by the first-order model"),
    ("simulated", "the same by simulation"), ("low", "lower end of its interval, 99.7 %"),
    ("high", "upper end of its interval, 99.7 %"), ("method", "how it was simulated"), EVALUATIONS,
    ("met", "1 where the interval holds what is asked, or all of it is above"))  # fmt: skip
KEY_NUMBERS = (
    KeyNumber(RELIABILITY, "failure", "failure probability, {method}", "largest", by=("method",),
          rank=lambda method: METHODS[method].accuracy,
          bounds=("failure_low", "failure_high"), interval="99.7 % between {low} and {high}"),
    KeyNumber(MOMENTS, "sigma", "standard deviation of {output}, {order}", "largest", by=("output", "order")),
    KeyNumber(CAPABILITY, "cpk", "smallest Cpk of {output}", "smallest", by=("output",)),
)  # fmt: skip
# Studies that it writes, and copies of the files that they read.
STUDIES = "allocated.yaml *input_*"
