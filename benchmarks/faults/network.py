"""Hosts on one machine: network namespaces on a switch, with links that can be cut or lose packets.

Needs root, iproute2, and for loss iptables.  Nothing outside of these namespaces is changed.
"""

import os
import shutil
import subprocess
from collections.abc import Sequence
from types import TracebackType
from typing import Self

SUBNET = "10.77.0"
SWITCH = "switch"


class NetworkError(RuntimeError):
    """A namespace, a link or a rule cannot be created; the text is the tool's output."""


def problem() -> str | None:
    """Reason why such a network cannot be created here; None when it can."""
    if os.name != "posix" or os.geteuid() != 0:
        return "network namespaces need root"
    missing = [tool for tool in ("ip", "iptables") if shutil.which(tool) is None]
    if missing:
        return f"not installed: {', '.join(missing)} (Debian: iproute2, iptables)"
    try:
        with Network(["probe"], f"zcprobe{os.getpid()}") as network:
            network.lose("probe", 0.5)
    except NetworkError as error:
        return f"network namespaces cannot be used here: {error}"
    return None


class Network:
    """Hosts with namespaces `PREFIX-NAME`; a context manager, which removes them at the end.  names: of the hosts."""

    def __init__(self, names: Sequence[str], prefix: str = "zc") -> None:
        self._prefix = prefix
        self._numbers = {name: number for number, name in enumerate(names, start=1)}

    def __enter__(self) -> Self:
        switch = self._namespace(SWITCH)
        try:
            self._ip("netns", "add", switch)
            self._ip("-n", switch, "link", "add", "bridge", "type", "bridge")
            self._ip("-n", switch, "link", "set", "bridge", "up")
            for name in self._numbers:
                self._add(name)
        except NetworkError:
            self._remove()
            raise
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._remove()

    def address(self, name: str) -> str:
        return f"{SUBNET}.{self._numbers[name]}"

    def command(self, name: str, arguments: Sequence[str]) -> list[str]:
        """Command line that runs `arguments` on a host."""
        return ["ip", "netns", "exec", self._namespace(name), *arguments]

    def cut(self, name: str) -> None:
        """Cut a host's link to the switch."""
        self._link(name, "down")

    def restore(self, name: str) -> None:
        self._link(name, "up")

    def lose(self, name: str, share: float) -> None:
        """Drop this share of the packets to and from a host; 0: none."""
        for chain in ("INPUT", "OUTPUT"):
            self._run(*self.command(name, ["iptables", "-w", "-F", chain]))
            if share:
                drop = ["-m", "statistic", "--mode", "random", "--probability", f"{share:.4f}"]
                self._run(*self.command(name, ["iptables", "-w", "-A", chain, *drop, "-j", "DROP"]))

    def _add(self, name: str) -> None:
        host, switch, port = self._namespace(name), self._namespace(SWITCH), self._port(name)
        self._ip("netns", "add", host)
        self._ip("-n", switch, "link", "add", port, "type", "veth", "peer", "name", "eth0", "netns", host)
        self._ip("-n", switch, "link", "set", port, "master", "bridge", "up")
        self._ip("-n", host, "addr", "add", f"{self.address(name)}/24", "dev", "eth0")
        self._ip("-n", host, "link", "set", "lo", "up")
        self._ip("-n", host, "link", "set", "eth0", "up")

    def _remove(self) -> None:
        for name in (*self._numbers, SWITCH):
            subprocess.run(["ip", "netns", "del", self._namespace(name)], stderr=subprocess.DEVNULL, check=False)

    def _link(self, name: str, state: str) -> None:
        self._ip("-n", self._namespace(SWITCH), "link", "set", self._port(name), state)

    def _namespace(self, name: str) -> str:
        return f"{self._prefix}-{name}"

    def _port(self, name: str) -> str:
        return f"port{self._numbers[name]}"

    def _ip(self, *arguments: str) -> None:
        self._run("ip", *arguments)

    @staticmethod
    def _run(*command: str) -> None:
        done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, check=False)
        if done.returncode:
            raise NetworkError(f"{' '.join(command)}: {done.stderr.strip()}")
