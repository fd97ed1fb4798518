"""One block, one question: what was asked and answered, on one page."""
