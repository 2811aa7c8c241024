"""Requests to an ONVIF device over HTTP and HTTPS, with digest authentication.  [RFC 7616]"""

import hashlib
import http.client
import ssl
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from time import monotonic
from urllib.parse import urlsplit
from urllib.request import (
    AbstractDigestAuthHandler,
    HTTPPasswordMgrWithDefaultRealm,
    Request,
    parse_http_list,
    parse_keqv_list,
)

from zenocap.common.errors import UserError
from zenocap.common.runtime.http_deadline import connected

TIMEOUT_S = 5.0  # of each request; chosen by hand
DEVICE_S = 60.0  # of all requests to a device, which may be 70; chosen by hand
MOST_BYTES = 1 << 20  # of an answer
ALGORITHMS = {"SHA-256": hashlib.sha256, "MD5": hashlib.md5}  # of RFC 7616, the better one first
CHOICES = "--certificates FILE with that of the camera or its authority, or --any-certificate"


@dataclass(frozen=True)
class User:
    """Name and password of a user of the devices."""

    name: str
    password: str


@dataclass(frozen=True)
class Answer:
    """status: of HTTP.  text: up to MOST_BYTES + 1."""

    status: int
    text: bytes


def trusted(certificates: Path | None = None, *, any_certificate: bool = False) -> ssl.SSLContext:
    """TLS settings that check certificates and host names.

    certificates: PEM file of those that are trusted instead of the system's.  any_certificate: check nothing.
    Raises UserError for a file that cannot be read.
    """
    try:
        context = ssl.create_default_context(cafile=None if certificates is None else str(certificates))
    except (OSError, ssl.SSLError) as error:
        raise UserError(f"--certificates {certificates}: {error}; allowed: a file of certificates, PEM") from None
    if any_certificate:
        context.check_hostname = False
        context.verify_mode = ssl.CERT_NONE
    return context


class OnvifHttp:
    """Requests to the host and port of one address; redirections are not followed.  Raises UserError."""

    def __init__(self, address: str, user: User | None, tls: ssl.SSLContext) -> None:
        parts = urlsplit(address)
        if parts.scheme not in ("http", "https"):
            raise UserError(f"{address}: allowed: http:// or https://")
        self._address, self._tls, self._user = address, tls, user
        self._https, self._host, self._port = parts.scheme == "https", parts.hostname or "", parts.port
        self._digest = None if user is None else _Digest(address, user)
        self._challenge: dict[str, str] | None = None
        self._end_s = monotonic() + DEVICE_S

    @property
    def is_authenticated(self) -> bool:
        """Whether the device has asked for HTTP digest; then its SOAP messages need no password."""
        return self._challenge is not None

    def post(self, path: str, body: Callable[[], bytes]) -> Answer:
        """The answer to a request.  body: made again for a second request, once the device has asked for HTTP digest."""
        answer, challenges = self._posted(path, body())
        if answer.status != http.client.UNAUTHORIZED or not challenges:
            return answer
        known, self._challenge = self._challenge, self._chosen(challenges)
        if known is not None and known.get("nonce") == self._challenge.get("nonce"):
            raise UserError(f"{self._address}: user or password is wrong")
        answer, _ = self._posted(path, body())
        if answer.status == http.client.UNAUTHORIZED:
            raise UserError(f"{self._address}: user or password is wrong")
        return answer

    def _chosen(self, challenges: Iterable[str]) -> dict[str, str]:
        """The challenge with the best algorithm."""
        if self._digest is None:
            raise UserError(f"{self._address}: it wants a user: --user NAME")
        digests = []
        for challenge in challenges:
            scheme, _, rest = challenge.partition(" ")
            if scheme.lower() == "digest":
                pairs = [pair for pair in parse_http_list(rest) if "=" in pair]
                digests.append({key.lower(): value for key, value in parse_keqv_list(pairs).items()})
        for algorithm in ALGORITHMS:
            for digest in digests:
                ways = [way.strip() for way in digest.get("qop", "auth").split(",")]
                named = digest.get("algorithm", "MD5").upper() == algorithm
                if named and "auth" in ways and {"realm", "nonce"} <= digest.keys():
                    return digest | ({"qop": "auth"} if "qop" in digest else {})
        raise UserError(
            f"{self._address}: it wants an authentication that is not supported: "
            f"allowed: ONVIF's own, and HTTP digest with {' or '.join(ALGORITHMS)}"
        )

    def _posted(self, path: str, body: bytes) -> tuple[Answer, list[str]]:
        """Answer, and challenges for an authentication."""
        headers = {"Content-Type": "application/soap+xml; charset=utf-8"}
        if self._challenge is not None and self._digest is not None:
            headers["Authorization"] = self._digest.answer(path, body, self._challenge)
        left_s = max(0.01, min(TIMEOUT_S, self._end_s - monotonic()))
        connection = http.client.HTTPConnection(self._host, self._port, timeout=left_s)
        if self._https:
            connection = http.client.HTTPSConnection(self._host, self._port, timeout=left_s, context=self._tls)
        try:
            with connected(connection, left_s):
                connection.request("POST", path, body, headers)
                response = connection.getresponse()
                challenges = response.headers.get_all("WWW-Authenticate") or []
                return Answer(response.status, response.read(MOST_BYTES + 1)), challenges
        except ssl.SSLCertVerificationError as error:
            raise UserError(f"{self._address}: its certificate is not trusted: {error.verify_message}; {CHOICES}") from None
        except (OSError, http.client.HTTPException) as error:
            raise UserError(f"{self._address}: no answer: {error or type(error).__name__}") from None


class _Digest(AbstractDigestAuthHandler):
    """Answers to challenges, with the algorithms that the standard library lacks, and names and passwords in UTF-8."""

    def __init__(self, address: str, user: User) -> None:
        passwords = HTTPPasswordMgrWithDefaultRealm()
        parts = urlsplit(address)
        self._base = f"{parts.scheme}://{parts.netloc}"
        passwords.add_password(None, f"{self._base}/", user.name, user.password)
        super().__init__(passwords)

    def answer(self, path: str, body: bytes, challenge: dict[str, str]) -> str:
        """Value of the header `Authorization`."""
        request = Request(f"{self._base}{path}", body, method="POST")
        return f"Digest {self.get_authorization(request, challenge)}"

    def get_algorithm_impls(self, algorithm: str) -> tuple[Callable[[str], str], Callable[[str, str], str]]:
        new = ALGORITHMS[algorithm.upper()]

        def digest(text: str) -> str:
            return new(text.encode()).hexdigest()

        return digest, lambda secret, data: digest(f"{secret}:{data}")
