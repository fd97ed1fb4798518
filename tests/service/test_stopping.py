"""A service that is told to end answers every request that it has taken."""

import http.client
import threading
import time
from contextlib import closing

import pytest

from benchmarks.running_service import running_service
from rbfrag.service.work import EXAMPLE as RECORD

PATH = "/v1/predict?p2=3&kr=0.1&pgv=0.6"


class Client(threading.Thread):
    """Asks again and again until the service is gone.

    Args:
        port: where the service listens.
        fresh: a new connection for each request.
    """

    def __init__(self, port, *, fresh):
        super().__init__()
        self.port = port
        self.fresh = fresh
        self.answered = 0
        self.lost = []

    def run(self):
        while self.ask_on_one_connection():
            pass

    def ask_on_one_connection(self):
        """Return whether there may be another connection."""
        with closing(http.client.HTTPConnection("127.0.0.1", self.port, timeout=60)) as connection:
            try:
                connection.connect()
            except OSError:
                return False  # nobody listens any more
            while True:
                try:
                    connection.request("GET", PATH)
                    with connection.getresponse() as answer:
                        body = answer.read()
                except (OSError, http.client.HTTPException) as error:
                    self.lost.append(repr(error))
                    return False
                assert answer.status == 200, body
                assert body.endswith(b"}")
                self.answered += 1
                if self.fresh:
                    return True
                if answer.will_close:
                    return False  # told that it ends


def sent(port, result):
    """Ask for something that takes longer."""
    with closing(http.client.HTTPConnection("127.0.0.1", port, timeout=120)) as connection:
        connection.request("POST", "/v1/spectrum?p2=3,1&polarity=both", RECORD.encode())
        with connection.getresponse() as answer:
            result.append((answer.status, answer.read()))


@pytest.mark.parametrize("workers", [1, 2])
def test_no_request_that_was_taken_is_lost(tmp_path, workers):
    with running_service(tmp_path, workers=workers, time_limit=120.0) as running:
        sent(running.port, [])  # waits until the kernels are compiled
        clients = [Client(running.port, fresh=i % 2 == 1) for i in range(8)]
        for client in clients:
            client.start()
        time.sleep(1.5)
        uploaded = []
        uploads = [threading.Thread(target=sent, args=(running.port, uploaded)) for _ in range(4)]
        for upload in uploads:
            upload.start()
        time.sleep(0.5)
        running.terminate()
        for thread in (*clients, *uploads):
            thread.join(120)
            assert not thread.is_alive()
    requests = [line for line in running.lines() if line["event"] == "request"]
    taken = [line for line in requests if line["path"] == "/v1/predict"]
    assert {line["status"] for line in requests} == {200}
    assert sum(client.answered for client in clients) == len(taken) > 20
    # whoever had a connection when the service was told to end has been answered
    assert [client.lost for client in clients if not client.fresh] == [[]] * 4
    assert [status for status, _ in uploaded] == [200] * 4
    assert not [line for line in running.lines() if line["level"] == "error"]
