"""The reference: every word that a study, a command or a result knows, from where the code declares it."""

from mechdesign.door.reference.entries import Entry
from mechdesign.door.reference.keys import place
from mechdesign.door.reference.lookup import below, find, holding, near
from mechdesign.door.reference.pages import PAGE, SHIPPED, pages, studies, text_of
from mechdesign.door.reference.sources import entries
from mechdesign.door.reference.tables import tables

__all__ = [
    "PAGE",
    "SHIPPED",
    "Entry",
    "below",
    "entries",
    "find",
    "holding",
    "near",
    "pages",
    "place",
    "studies",
    "tables",
    "text_of",
]
