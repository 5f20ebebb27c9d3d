"""Helpers of the judges of integrations, which run an example and look at it from outside."""

import os
import socket
import subprocess
import sys
import time

failures = []


def check(what, is_so, found=""):
    print(("ok    " if is_so else "WRONG ") + what + (f": {found}" if found != "" else ""), flush=True)
    if not is_so:
        failures.append(what)


def end():
    """Ends the judge, with 1 if something is not as it is to be. Threads of what is judged may wait for others at an orderly end."""
    print("all as it is to be" if not failures else f"{len(failures)} are not as they are to be: {failures}", flush=True)
    os._exit(1 if failures else 0)


def free_port():
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


def until(condition, seconds):
    """Whether it becomes true within that time."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if condition():
            return True
        time.sleep(0.002)
    return condition()


class Program:
    """A program, and its end."""

    def __init__(self, *command, **more):
        self.process = subprocess.Popen(command, **more)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()


def python(code, *arguments, **more):
    """Another Python that runs this code."""
    return Program(sys.executable, "-c", code, *arguments, **more)
