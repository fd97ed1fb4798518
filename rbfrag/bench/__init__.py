"""Speed reported against error: cases, methods, an extended-precision reference, comparisons."""
