"""Critical strength with its certificate; critical scale; critical displacement."""
