"""The socket that the service listens at."""

from __future__ import annotations

import socket

from rbfrag.service.run import listener


def test_answers_do_not_wait_for_the_client_to_acknowledge_their_head() -> None:
    with (
        listener("127.0.0.1", 0) as listening,
        socket.create_connection(listening.getsockname()[:2]),
    ):
        connection, _ = listening.accept()
        with connection:
            assert connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY) != 0
