"""Response of rigid blocks to shaking, and the critical strength."""
