"""What a run looks like: tables, figures, a page, and the folder that holds them."""
