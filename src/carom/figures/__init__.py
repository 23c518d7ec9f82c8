"""What draws curves, bands and tables: it knows arrays only, so that every result can draw itself with it."""
