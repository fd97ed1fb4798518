"""Every quantity once: name, label, unit, range, symbol, aliases, credible values, storage."""
