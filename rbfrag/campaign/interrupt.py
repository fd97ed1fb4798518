"""Handling of Ctrl-C in long work: the first press ends it after the current step, the second
immediately.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing.util import _run_finalizers  # type: ignore[attr-defined]

STOPPING = "stopping after the motion in hand; press again to stop now"

INTERRUPTED = 130
"""Exit status of a program that SIGINT ended: 128 and the signal's number."""

Stopped = Callable[[], bool]
"""Whether a stop was asked for."""


def never() -> bool:
    """Return False: no stop is requested."""
    return False


@contextmanager
def stopped_by_interrupts() -> Iterator[Stopped]:
    """Yield a function that returns whether Ctrl-C was pressed in a ``with`` block.

    The first press says so on standard error at once. The second kills the worker processes and
    ends the program with status 130: a transaction that is open is rolled back by its database.
    """
    if threading.current_thread() is not threading.main_thread():
        yield never  # only the main thread may handle signals
        return
    pressed = threading.Event()
    # A handler in Python would wait until the kernel that the main thread is in returns; the byte
    # that Python writes for each signal is there at once, and a thread reads it meanwhile.
    heard, tells = socket.socketpair()
    tells.setblocking(False)
    listener = threading.Thread(target=_listen, args=(heard, pressed), daemon=True)
    before = signal.signal(signal.SIGINT, lambda *_: None)
    earlier_fd = signal.set_wakeup_fd(tells.fileno(), warn_on_full_buffer=False)
    listener.start()
    try:
        yield pressed.is_set
    finally:
        signal.set_wakeup_fd(earlier_fd)
        tells.close()
        listener.join()
        # a press while the program ends must not change its status
        signal.signal(signal.SIGINT, signal.SIG_IGN if pressed.is_set() else before)


def _listen(heard: socket.socket, pressed: threading.Event) -> None:
    """Handle each press of Ctrl-C until the other end is closed."""
    with heard:
        while signals := heard.recv(64):
            for number in signals:
                if number == signal.SIGINT:
                    _answer(pressed)


def _answer(pressed: threading.Event) -> None:
    if not pressed.is_set():
        pressed.set()
        # not print: the main thread may be in the midst of one
        os.write(2, f"\n{STOPPING}\n".encode())
        return
    try:
        for worker in multiprocessing.active_children():
            worker.kill()
        _run_finalizers(0)  # else the tracker of resources says that their semaphores leaked
    finally:
        os._exit(INTERRUPTED)


@contextmanager
def held_back() -> Iterator[None]:
    """Block SIGINT in a ``with`` block; processes started in it never receive it."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
