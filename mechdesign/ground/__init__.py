"""What everything stands on: numbers, errors, expressions, tables, work; nothing here knows a mechanism."""
