"""The reference: every word that a study, a command or a result knows, from where the code declares it."""

from mechdesign.reference.entries import Entry
from mechdesign.reference.keys import place
from mechdesign.reference.lookup import below, find, holding, near
from mechdesign.reference.sources import entries
from mechdesign.reference.tables import tables

__all__ = ["Entry", "below", "entries", "find", "holding", "near", "place", "tables"]
