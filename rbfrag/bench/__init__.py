"""Speed measured against error, beside other programs."""
