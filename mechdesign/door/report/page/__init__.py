"""One HTML file that shows a whole study: in words, in pictures, in tables, and moving."""
