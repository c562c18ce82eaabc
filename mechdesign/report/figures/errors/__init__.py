"""Parts of the pictures of errors and of their reliability."""
