"""mypy with a garbage collector that seldom looks: it takes a quarter of mypy's time and finds little."""

import gc

from mypy.__main__ import console_entry

gc.set_threshold(2_000_000, 5, 5)
# mypy would set smaller ones.
gc.set_threshold = lambda *_: None

console_entry()
