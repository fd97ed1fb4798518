"""Integration of the equations of motion: one Taylor step, events, excursions, batches."""
