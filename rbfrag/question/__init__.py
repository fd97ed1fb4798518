"""What may be said of blocks and shaking, declared once."""
