"""Several processes that answer at one address."""

from __future__ import annotations

from uvicorn.supervisors import Multiprocess


class Workers(Multiprocess):
    """Processes of uvicorn that end together."""

    def terminate_all(self) -> None:
        """Tell every process to end.

        Nobody may connect any more: this process holds the address too, and what it let in
        nobody would answer.
        """
        for listener in self.sockets:
            listener.close()
        super().terminate_all()
