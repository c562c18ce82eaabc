"""Tables of a workspace and their columns: names, meanings, units and formulas."""

from __future__ import annotations

from mechdesign.ground.columns import ColumnKind
from mechdesign.ground.indices import REGIONAL, STATISTICS
from mechdesign.ground.results import KeyNumber, TableKind
from mechdesign.questions.columns import DRIVE

HELD = ColumnKind("<held>", "held coordinate", "as the coordinate")
PLACE = ColumnKind("x, y", "place of the point", "length")
PIECE = ColumnKind("piece", "piece of the region: 1 is the sketch's, or else the largest")
SUI = ColumnKind("SUI", REGIONAL["SUI"].meaning, "", "area/box_area")
AREA = ColumnKind("area", REGIONAL["area"].meaning, "area")
BOX_AREA = ColumnKind("box_area", REGIONAL["box_area"].meaning, "area")
INDICES = TableKind.of("indices", "performance indices over the region",
    HELD, ("GII", REGIONAL["GII"].meaning, "", "integral of sigma_min/sigma_max over the area"),
    ("GRI", REGIONAL["GRI"].meaning, "as resistivity", "integral of 1/abs(det J) over the area"), SUI, AREA, BOX_AREA,
    *((f"<index>_{name}", f"{statistic} over the region: <meaning of the index>", "as the index")
      for name, statistic in STATISTICS.items()),
    ("<statistic>_error", "estimated error of <statistic>", "as the statistic"),
    ("circle_x, circle_y", "centre of the largest circle inside the region", "length"),
    ("circle_radius", "radius of the largest circle inside the region", "length"),
    ("rectangle_x, rectangle_y", "centre of the largest axis-parallel rectangle inside the region", "length"),
    ("rectangle_width", "width of the largest axis-parallel rectangle inside the region", "length"),
    ("rectangle_height", "height of the largest axis-parallel rectangle inside the region", "length"))  # fmt: skip
PATH_INDICES = TableKind.of("indices", "the path as a whole",
    ("from", "<drive> where the motion begins", "length or angle"), ("to", "<drive> where it ends", "length or angle"),
    ("from_at", "what ends the motion there"), ("to_at", "what ends the motion there"),
    ("closed", "1 where the path closes after a turn"), ("length", "length of the path", "length"),
    ("length_error", "estimated error of length", "length"),
    ("box_x", "left side of the rectangle around the path", "length"),
    ("box_y", "lower side of the rectangle around the path", "length"),
    ("box_width", "width of the rectangle around the path", "length"),
    ("box_height", "height of the rectangle around the path", "length"),
    ("speed_ratio_mean", "length of the path over the drive's travel", "as speed_ratio"),
    ("speed_ratio_min", "smallest speed ratio of the rows", "as speed_ratio"),
    ("speed_ratio_max", "largest speed ratio of the rows", "as speed_ratio"))  # fmt: skip
PATH = TableKind.of("path", "the point's path, from limit to limit of the motion",
    ("piece", "row of the indices"), DRIVE, PLACE,
    ("speed_ratio", "speed of the point over the drive's rate, per radian", "as length over the drive in radians"),
    ("resistivity", "1/speed_ratio", "as one over speed_ratio"),
    ("arc", "length of the path from its beginning", "length"))  # fmt: skip
TOTALS = TableKind.of("totals", "the indices over all held values",
    ("statistic", "column of the indices"), ("smallest", "smallest over the held values that have one, in `unit`"),
    ("mean", "mean over the held values that have one, in `unit`"),
    ("largest", "largest over the held values that have one, in `unit`"),
    ("smallest_at_<held>", "held value at which the smallest is", "as the coordinate"),
    ("largest_at_<held>", "held value at which the largest is", "as the coordinate"),
    ("unit", "unit of the row's values"), ("values", "held values, empty regions among them"),
    ("empty", "held values of empty regions"))  # fmt: skip
PIECES = TableKind.of("pieces", "pieces of the region that do not hang together",
    HELD, PIECE, ("area", "area of the piece", "area"), ("x, y", "a place inside the piece", "length"),
    ("sketch", "whether it holds the point's place in the sketch"))  # fmt: skip
BOUNDARY = TableKind.of("boundary", "boundary of the region, curve by curve",
    HELD, PLACE, ("kind", "what ends the region: limit or singularity"),
    ("<drive>", "drive's value there", "length or angle"),
    ("at", "which limit or singularity"), ("theta", "angle of the ray about the centre of the scan", "angle"),
    ("side", "which end of the ray's interval"), ("curve", "smooth part of the boundary"), PIECE)  # fmt: skip
LOCAL = TableKind.of("local", "local indices on a grid that follows the boundary",
    HELD, PLACE, ("det_J", "determinant of the Jacobian, per radian", "as its outputs over the drives, multiplied"),
    ("<index>", "<meaning of the index>", "as the index"), ("patch", "part of the region between two boundary curves"),
    ("ray", "ray of the patch's grid"), ("node", "node along the ray, from the inner to the outer boundary"),
    PIECE)  # fmt: skip
SINGULARITIES = TableKind.of("singularities", "curves of singularities inside the region and around it",
    HELD, ("curve", "points of one curve, in order"),
    ("kind", "forward: the drives do not hold the mechanism; inverse: a leg is stretched or folded"), PLACE,
    ("cause", "which links, and what they do there"))  # fmt: skip
KEY_NUMBERS = (
    KeyNumber(INDICES, "area", "area of the region", "largest", several="regions"),
    KeyNumber(INDICES, "SUI", "area over that of the rectangle around it", "largest", several="regions"),
    KeyNumber(INDICES, "circle_radius", "radius of the largest circle inside", "largest", several="regions"),
    KeyNumber(INDICES, "<index>_mean", "mean {name}", "largest", several="regions"),
)  # fmt: skip
