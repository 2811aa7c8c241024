"""TCP connections that send nothing, held by another process, whose descriptors are not this one's."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

PROGRAM = """
import resource, socket, sys
_, most = resource.getrlimit(resource.RLIMIT_NOFILE)
resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))  # the limit of its parent may be low
host, port, count = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
held = []
for _ in range(count):
    try:
        held.append(socket.create_connection((host, port), 30.0))
    except OSError:
        break
print(len(held), flush=True)
sys.stdin.read()
"""


@contextmanager
def bare_connections(host: str, port: int, count: int) -> Iterator[int]:
    """Hold up to `count` connections; yields the number that was accepted by the system."""
    command = [sys.executable, "-c", PROGRAM, host, str(port), str(count)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            yield int(process.stdout.readline())
        finally:
            process.stdin.close()
            process.wait(10)
