"""Results as files: CSV tables, PNG pictures and the manifest that describes them."""
