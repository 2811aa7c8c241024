"""Objects that a `with` statement closes."""

from abc import ABC, abstractmethod
from typing import Self


class Closable(ABC):
    """`close` is called at the end of a `with` block."""

    @abstractmethod
    def close(self) -> None: ...

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
