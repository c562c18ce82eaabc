"""Tables of stiffness and their columns: names, meanings, units and formulas."""

from __future__ import annotations

from mechdesign.ground.columns import ColumnKind
from mechdesign.ground.results import KeyNumber, TableKind
from mechdesign.questions.columns import GIVEN, TIMED, VALID

LOAD = ColumnKind("load", "which of the study's loads")
STIFFNESS = TableKind.of("stiffness", "stiffness at the asked point per pose, axes of the world, per radian",
    TIMED, GIVEN, ("k_x, k_y", "load over its own displacement, the others free", "stiffness", "1/C11, 1/C22"),
    ("k_phi", "load over its own displacement, the others free", "rotational_stiffness", "1/C33"),
    ("k_min", "stiffness to a force in the softest direction, the body free to turn", "stiffness",
     "1/largest eigenvalue of [[C11, C12], [C12, C22]]"),
    ("k_max", "stiffness to a force in the stiffest direction, the body free to turn", "stiffness",
     "1/smallest eigenvalue of [[C11, C12], [C12, C22]]"), ("k_angle", "angle of the stiffest direction", "angle"),
    ("k_direction", "force in the asked direction over displacement along it", "stiffness",
     "1/(n^T C n), n along the direction"),
    ("K11, K12, K22", "stiffness matrix at the asked point; nan where rigid", "stiffness", "K = C^-1"),
    ("K13, K23", "stiffness matrix at the asked point; nan where rigid", "coupling_stiffness", "K = C^-1"),
    ("K33", "stiffness matrix at the asked point; nan where rigid", "rotational_stiffness", "K = C^-1"),
    ("rank", "number of independent wrenches that hold the body"),
    ("free_x, free_y", "the free twist, per radian where it turns; nan where none is free", "length"),
    ("free_phi", "the free twist, per radian where it turns; nan where none is free"), VALID,
    ("method", "serial legs: reciprocal screws [S4]; force method: any other"))  # fmt: skip
COMPLIANCE = TableKind.of(
    "compliance", "twist (dx, dy, dphi in radians) at the asked point per load, axes of the world",
    TIMED, GIVEN, ("C11, C12, C22", "displacement per load", "compliance"),
    ("C13, C23", "displacement per load", "coupling_compliance"),
    ("C33", "displacement per load", "rotational_compliance"))  # fmt: skip
EIGEN = TableKind.of("eigen", "eigen-stiffnesses by the characteristic length",
    TIMED, GIVEN, ("mode", "softest first"),
    ("stiffness", "eigenvalue of the scaled stiffness matrix", "stiffness",
     "eigenvalues of S K S, S = diag(1, 1, 1/length)"), ("dx, dy", "its twist, of unit size"),
    ("turn", "its twist: the characteristic length times dphi"))  # fmt: skip
SPRINGS = TableKind.of("springs", "springs that hold the body as its legs do",
    TIMED, GIVEN, ("leg", "links of the leg, from the base"),
    ("stiffness", "along its line, inf where rigid; where angle is nan about its point (<unit>)", "stiffness"),
    ("x, y", "a point on its line", "length"), ("angle", "direction of its line", "angle"))  # fmt: skip
DEFLECTIONS = TableKind.of("deflections", "deflections under the study's loads",
    TIMED, GIVEN, LOAD, ("fx, fy", "load at the asked point, 0 of one elsewhere", "force"),
    ("mz", "load at the asked point, 0 of one elsewhere", "moment"),
    ("dx, dy", "deflection of the asked point", "length"),
    ("dphi", "deflection of the asked point", "as radians"))  # fmt: skip
DISPLACEMENTS = TableKind.of("displacements", "displacements of all points under the study's loads",
    TIMED, GIVEN, LOAD, ("link", "link"), ("point", "its point"), ("x, y", "place without a load", "length"),
    ("dx, dy", "displacement", "length"))  # fmt: skip
FORCES = TableKind.of("forces", "what the joints bear under the study's loads",
    TIMED, GIVEN, LOAD, ("joint", "point, slide or coupling"),
    ("on", "what the force acts on: a link, 'asked' (the asked point), or the pin of a slot ('slot:') or of several "
     "links ('pin:')"), ("by", "what exerts it; in a telescopic leg its rod, on the part at its first end"),
    ("fx, fy", "force on the one by the other, axes of the world", "force"),
    ("mz", "moment likewise, about the joint's point", "moment"))  # fmt: skip
KEY_NUMBERS = (
    KeyNumber(STIFFNESS, "k_min", "smallest stiffness", "smallest"),
    KeyNumber(DEFLECTIONS, "dx", "largest deflection {name}", "size"),
    KeyNumber(STIFFNESS, "k_max", "largest stiffness", "largest"),
)  # fmt: skip
